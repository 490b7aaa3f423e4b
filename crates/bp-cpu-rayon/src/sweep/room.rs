//! The memory that sweeps need, before label sets are known and after.

use std::{
    ops::Range,
    sync::{Mutex, PoisonError},
};

use bp_core::{BAND_ROWS, Error, Patch, Plan, Schedule};

use super::{Band, seams, tasks, windows};

/// The patches of a row of a grid, and the most entries that they may have.
pub(super) fn most_entries(plan: &Plan, grid: usize) -> [usize; 2] {
    let patches = Patch::all(plan.size(grid).width, 0..1).len();
    [patches, patches.saturating_mul(plan.model().labels())]
}

/// The most rows that a band of a grid has.
pub(super) fn most_rows(plan: &Plan, grid: usize) -> usize {
    BAND_ROWS.min(plan.size(grid).height)
}

/// The grids that are swept.
pub(super) fn swept(plan: &Plan) -> Range<usize> {
    if plan.settings().schedule == Schedule::Sweep { 0..plan.grids() } else { 0..0 }
}

/// The bytes that [`Swept`](super::Swept) will hold, if label sets hold this many labels.
pub(crate) fn bytes(plan: &Plan, labels: usize) -> u64 {
    let entries = |grid: usize| {
        let [patches, entries] = most_entries(plan, grid);
        if plan.has_label_sets(grid) { patches.saturating_mul(labels) } else { entries }
    };
    if swept(plan).is_empty() {
        return 0;
    }
    let slots = tasks::predicted_slots(plan, rayon::current_num_threads());
    let grids = slots.into_iter().enumerate().map(|(grid, [bands, seams])| {
        let [patches, _] = most_entries(plan, grid);
        let bands = (0..bands).map(|_| Band::needed(plan, grid, patches, entries(grid)));
        let seams = (0..seams).map(|_| seams::bytes(plan, grid, patches, entries(grid)));
        bands.chain(seams).fold(0, u64::saturating_add)
    });
    let [patches, _] = most_entries(plan, 0);
    let most = (0..plan.grids()).map(entries).max().unwrap_or(0);
    let answer = (size_of::<u16>() * plan.image_size().pixels()) as u64;
    grids.fold(windows::bytes(plan, patches, most) + answer, u64::saturating_add)
}

/// The bytes that may be allocated in a solve, when label sets are known, by all threads.
pub(crate) struct Room<'a> {
    plan: &'a Plan,
    bytes: u64,
    left: Mutex<Left>,
}

/// What is left of it.
struct Left {
    bytes: u64,
    /// The most entries that windows have room for.
    entries: usize,
}

impl<'a> Room<'a> {
    /// So many bytes, of which some are held, among them windows for so many entries.
    pub(super) fn new(plan: &'a Plan, bytes: u64, held: u64, entries: usize) -> Self {
        Self { plan, bytes, left: Mutex::new(Left { bytes: bytes.saturating_sub(held), entries }) }
    }

    /// Takes what rows with so many entries need: all windows must have room for them, and they keep `kept` more bytes.
    pub(super) fn take(&self, entries: usize, kept: u64) -> Result<(), Error> {
        let mut left = self.left.lock().unwrap_or_else(PoisonError::into_inner);
        let [patches, _] = most_entries(self.plan, 0);
        let most = left.entries.max(entries);
        let [before, after] = [left.entries, most].map(|entries| windows::bytes(self.plan, patches, entries));
        let more = (after - before).saturating_add(kept);
        let available = Some(self.bytes);
        let needed = (self.bytes - left.bytes).saturating_add(more);
        let bytes = left.bytes.checked_sub(more);
        *left =
            Left { bytes: bytes.ok_or(Error::OutOfMemory { what: "label sets", needed, available })?, entries: most };
        Ok(())
    }
}
