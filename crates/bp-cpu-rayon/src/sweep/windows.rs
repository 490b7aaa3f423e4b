//! Memory for the rows that threads pass at the same time.

use std::{
    ops::Range,
    sync::{Mutex, PoisonError},
};

use bp_core::{
    BAND_ROWS, Error, LabelSet, Patch, Plan, Schedule,
    memory::{self, Buffer},
};

use super::{
    Sweep,
    crossings::{self, Crossings},
    decided::{self, Decided},
    lists::{self, Lists},
    messages::{self, Messages, Place},
    refine::{self, CoarseRows},
};
use crate::block::Block;

/// The memory in which one thread passes messages.
#[derive(Default)]
pub(crate) struct Window {
    /// The labels and messages of rows that keep none of their own.
    pub(crate) lists: Lists,
    pub(crate) messages: Messages,
    pub(crate) work: Work,
}

/// What a pass needs besides labels and messages.
#[derive(Default)]
pub(crate) struct Work {
    /// The label sets of the patches.
    pub(crate) sets: Vec<LabelSet>,
    /// Data costs, `[row][plane][entry]`.
    pub(crate) costs: Buffer<Block>,
    pub(crate) coarse_rows: CoarseRows,
    pub(crate) crossings: Crossings,
    pub(crate) decided: Decided,
}

/// The costs of so many rows, for each entry. Sums of grid 3 are made of eight.
fn costs(rows: usize) -> usize {
    2 * rows.max(4)
}

impl Work {
    /// Finds the label sets of these rows of a grid, which come from rows of labels `coarser`. Returns how many labels they have.
    pub(crate) fn find_sets<'a>(
        &mut self,
        plan: &Plan,
        grid: usize,
        rows: Range<usize>,
        coarser: impl Fn(usize) -> &'a [u16],
    ) -> Result<usize, Error> {
        let patches = Patch::all(plan.size(grid).width, rows);
        self.sets.clear();
        self.fit_patches(patches.len())?;
        self.sets.iter_mut().zip(patches).for_each(|(set, patch)| *set = LabelSet::of(plan, grid, &patch, &coarser));
        Ok(self.sets.iter().map(LabelSet::count).sum())
    }

    /// Makes room for the sets and the decided labels of so many patches.
    fn fit_patches(&mut self, patches: usize) -> Result<(), Error> {
        memory::grow("label sets", &mut self.sets, patches, LabelSet::all(0))?;
        self.decided.fit(patches)
    }

    /// Makes room for so many rows with so many entries each.
    pub(crate) fn fit(&mut self, rows: usize, entries: usize) -> Result<(), Error> {
        self.costs.grow("data cost", costs(rows).saturating_mul(entries), Block::ZERO)?;
        self.coarse_rows.fit(entries)?;
        self.crossings.fit(entries)
    }

    /// The costs of a plane of a patch, which is in row y.
    #[inline(always)]
    pub(crate) fn costs<'a>(&'a self, sweep: &'a Sweep<'_>, patch: usize, y: usize, at: &Place<'_>) -> &'a [Block] {
        let computed = || &self.costs[(2 * at.row + at.plane) * at.entries..][at.range.clone()];
        sweep.costs.ready(sweep, patch, at.plane, y).unwrap_or_else(computed)
    }

    fn bytes(&self) -> u64 {
        memory::bytes(&self.sets)
            + self.costs.bytes()
            + self.coarse_rows.bytes()
            + self.crossings.bytes()
            + self.decided.bytes()
    }
}

/// A window for every thread that may sweep at the same time.
#[derive(Default)]
pub(crate) struct Windows {
    windows: Vec<Mutex<Window>>,
}

/// The number of windows: one for each thread of the pool, but no more than there are bands, and none under other
/// schedules.
fn windows(plan: &Plan) -> usize {
    let bands = plan.image_size().height.div_ceil(BAND_ROWS);
    if plan.settings().schedule == Schedule::Sweep { rayon::current_num_threads().min(bands) } else { 0 }
}

/// The bytes that [`Windows`] with so many patches and entries hold.
pub(crate) fn bytes(plan: &Plan, patches: usize, entries: usize) -> u64 {
    let rows = BAND_ROWS.min(plan.image_size().height);
    let costs = ((costs(rows) * size_of::<Block>()) as u64).saturating_mul(entries as u64);
    let sets = (patches * size_of::<LabelSet>()) as u64;
    let work = sets + costs + refine::bytes(entries) + crossings::bytes(entries) + decided::bytes(patches);
    let window = work.saturating_add(messages::bytes(rows, entries)).saturating_add(lists::bytes(patches, entries));
    (windows(plan) as u64).saturating_mul(window)
}

/// A window that no thread uses.
fn unused(window: &mut Mutex<Window>) -> &mut Window {
    window.get_mut().unwrap_or_else(PoisonError::into_inner)
}

impl Windows {
    /// Makes windows for the threads of the current pool.
    pub(crate) fn new(plan: &Plan) -> Self {
        Self { windows: (0..windows(plan)).map(|_| Mutex::default()).collect() }
    }

    /// Makes room in all windows for rows with so many patches and entries.
    pub(crate) fn fit(&mut self, plan: &Plan, patches: usize, entries: usize) -> Result<(), Error> {
        let rows = BAND_ROWS.min(plan.image_size().height);
        self.windows.iter_mut().map(unused).try_for_each(|window| {
            window.lists.fit(patches, entries)?;
            window.messages.fit(rows, entries)?;
            window.work.fit_patches(patches)?;
            window.work.fit(rows, entries)
        })
    }

    /// Makes all windows as large as any had to become. So memory does not depend on which thread passed which rows, and
    /// the same pair needs no more when other threads pass them.
    pub(crate) fn even_out(&mut self, plan: &Plan, patches: usize) -> Result<(), Error> {
        let most = self.most_entries();
        self.fit(plan, patches, most)
    }

    /// The most entries that any window has room for.
    pub(crate) fn most_entries(&mut self) -> usize {
        self.windows.iter_mut().map(|window| unused(window).work.crossings.most_entries()).max().unwrap_or(0)
    }

    /// The number of windows.
    pub(crate) fn len(&self) -> usize {
        self.windows.len()
    }

    /// Calls `work` with a free window. A thread waits only if more threads than windows need one at the same time.
    pub(crate) fn with<R>(&self, work: impl FnOnce(&mut Window) -> R) -> R {
        let own = rayon::current_thread_index().unwrap_or(0) % self.windows.len();
        let (before, after) = self.windows.split_at(own);
        let free = after.iter().chain(before).find_map(|window| window.try_lock().ok());
        // A window holds nothing that outlives its rows, so a panic in others does no harm.
        let mut window = free.unwrap_or_else(|| self.windows[own].lock().unwrap_or_else(PoisonError::into_inner));
        work(&mut window)
    }

    /// The bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        let bytes = |window: &Mutex<Window>| {
            let Window { lists, messages, work } = &*window.lock().unwrap_or_else(PoisonError::into_inner);
            lists.bytes() + messages.bytes() + work.bytes()
        };
        self.windows.iter().map(bytes).sum()
    }
}
