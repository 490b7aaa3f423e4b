//! The memory that sweeps need, before label sets are known and after.

use std::ops::Range;

use bp_core::{BAND_ROWS, LabelSet, Patch, Plan, Schedule, Seam};
use rayon::prelude::*;

use super::{Band, band_bytes, seams, windows};

/// The patches of a row of a grid, and the most entries that they may have.
pub(super) fn most_entries(plan: &Plan, grid: usize) -> [usize; 2] {
    let patches = Patch::all(plan.size(grid).width, 0..1).len();
    [patches, patches.saturating_mul(plan.model().labels())]
}

/// The rows of the bands of a grid.
pub(super) fn band_rows(plan: &Plan, grid: usize) -> impl Iterator<Item = usize> + use<> {
    let height = plan.size(grid).height;
    (0..height).step_by(BAND_ROWS).map(move |first| BAND_ROWS.min(height - first))
}

/// For each grid whose labels are decided and kept, their number.
pub(super) fn decided(plan: &Plan) -> impl Iterator<Item = usize> + use<'_> {
    let swept = plan.settings().schedule == Schedule::Sweep;
    (0..plan.grids()).filter(move |&grid| swept && plan.decides_labels(grid)).map(|grid| plan.size(grid).pixels())
}

/// The bytes that [`Swept`](super::Swept) will hold, if label sets hold this many labels.
pub(crate) fn bytes(plan: &Plan, labels: usize) -> u64 {
    let entries = |grid: usize| {
        let [patches, entries] = most_entries(plan, grid);
        [patches, if plan.has_label_sets(grid) { patches.saturating_mul(labels) } else { entries }]
    };
    let bands = (1..plan.grids()).map(|grid| {
        let [patches, entries] = entries(grid);
        band_rows(plan, grid).map(|rows| band_bytes(rows, patches, entries)).fold(0, u64::saturating_add)
    });
    // Grids of even and of odd index share memory.
    let mut most = [0; 2];
    bands.zip([1, 0].into_iter().cycle()).for_each(|(bytes, parity)| most[parity] = bytes.max(most[parity]));
    let bands = if plan.settings().schedule == Schedule::Sweep { most } else { [0; 2] };
    let shared = shared_bytes(plan, (0..plan.grids()).map(|grid| entries(grid)[1]).max().unwrap_or(0));
    let labels = decided(plan).map(|labels| (labels * size_of::<u16>()) as u64);
    bands.into_iter().chain(labels).chain([shared]).fold(0, u64::saturating_add)
}

/// The bytes of what the bands of all grids use: windows and seams, whose rows have at most so many entries.
fn shared_bytes(plan: &Plan, entries: usize) -> u64 {
    let [patches, _] = most_entries(plan, 0);
    windows::bytes(plan, patches, entries).saturating_add(seams::bytes(plan, patches, entries))
}

/// The entries of the label sets of a grid.
pub(super) struct Entries {
    /// Those of each band.
    bands: Vec<usize>,
    /// The most of a band or seam.
    most: usize,
}

impl Entries {
    /// Counts the entries of a grid, whose label sets come from the labels `coarser`.
    pub(super) fn count(plan: &Plan, grid: usize, coarser: &[u16]) -> Self {
        let size = plan.size(grid);
        let entries = |rows: Range<usize>| -> usize {
            let sets = Patch::all(size.width, rows).map(|patch| LabelSet::of(plan, grid, &patch, coarser));
            sets.map(|set| set.count()).sum()
        };
        let first_rows: Vec<_> = (0..size.height).step_by(BAND_ROWS).collect();
        let rows = |&first: &usize| entries(first..size.height.min(first + BAND_ROWS));
        let bands: Vec<usize> = first_rows.par_iter().map(rows).collect();
        let seams: Vec<_> = Seam::all(size.height).collect();
        let most_of_seams = seams.par_iter().map(|seam| entries(seam.rows())).max();
        Self { most: bands.iter().copied().chain(most_of_seams).max().unwrap_or(0), bands }
    }

    /// The bytes that the bands of the grid will hold, given what is held already.
    pub(super) fn band_bytes(&self, plan: &Plan, grid: usize, held: &[Band]) -> u64 {
        let [patches, _] = most_entries(plan, grid);
        let needed = band_rows(plan, grid).zip(&self.bands).map(|(rows, &entries)| band_bytes(rows, patches, entries));
        let all = held.iter().map(Band::bytes).zip(needed.chain(std::iter::repeat(0)));
        all.map(|(held, needed)| held.max(needed)).fold(0, u64::saturating_add)
    }

    /// The bytes of windows and seams, given that the coarser grids have been swept.
    pub(super) fn shared_bytes(&self, plan: &Plan) -> u64 {
        let [_, all] = most_entries(plan, plan.finest_with_all_labels());
        shared_bytes(plan, self.most.max(all))
    }
}
