//! The state of the schedule `sweep` from grid to grid: bands and seams.

use std::{
    ops::Range,
    sync::atomic::{AtomicU64, Ordering},
};

use bp_core::{BAND_ROWS, Error, Plan, Seam, Side};
use fearless_simd::Level;
use rayon::prelude::*;

use super::{
    Beside, CostSource, Sweep, Windows,
    coarser::Coarser,
    kept::Kept,
    made::Made,
    pass::gaps,
    room::{self, Room, band_rows, most_entries},
    seams::Prepared,
    tasks::{self, Part, Passed, Queue, Task},
};
use crate::layout::Layout;

/// What is kept of all grids.
#[derive(Default)]
pub(crate) struct Swept {
    windows: Windows,
    grids: Vec<Kept>,
    tasks: Vec<Task>,
    /// The message entries computed so far in a solve.
    updates: AtomicU64,
}

/// A grid that is swept.
pub(crate) struct Grid<'a> {
    pub(crate) level: Level,
    pub(crate) plan: &'a Plan,
    pub(crate) index: usize,
    pub(crate) layouts: &'a [Layout],
    pub(crate) costs: CostSource<'a>,
}

impl Swept {
    /// Allocates everything, except for what label sets make shorter.
    pub(crate) fn new(plan: &Plan) -> Result<Self, Error> {
        let grids = room::swept(plan).map(|grid| Kept::new(plan, grid)).collect::<Result<_, _>>()?;
        let tasks = if room::swept(plan).is_empty() {
            Vec::new()
        } else {
            tasks::all(plan, rayon::current_num_threads()).collect()
        };
        let mut windows = Windows::new(plan);
        let ([patches, _], [_, entries]) = (most_entries(plan, 0), most_entries(plan, plan.finest_with_all_labels()));
        windows.fit(plan, patches, entries)?;
        Ok(Self { windows, grids, tasks, updates: AtomicU64::new(0) })
    }

    /// Runs all loops on these grids, in no more than `bytes` bytes in all. Threads go on to the next grid while others are at the
    /// last bands of this one. Calls `passed` with the message entries computed so far, counted for all labels; stops if it breaks.
    pub(crate) fn run<'a>(
        &mut self,
        plan: &Plan,
        grids: Range<usize>,
        grid: impl Fn(usize) -> Grid<'a> + Sync,
        bytes: u64,
        passed: &mut Passed<'_>,
    ) -> Result<(), Error> {
        if grids.end == plan.grids() {
            self.updates.store(0, Ordering::Relaxed);
        }
        self.grids[..grids.end].iter_mut().for_each(Kept::forget);
        let room = Room::new(plan, bytes, self.bytes(), self.windows.most_entries());
        let queue = Queue::new(tasks::of_grids(&self.tasks, grids), passed);
        // No more threads than windows, so that none waits for one.
        (0..self.windows.len()).into_par_iter().with_max_len(1).for_each(|_| {
            queue.work(|task| self.run_task(&grid(task.grid), task.part, &room));
        });
        let result = queue.result();
        let [patches, _] = most_entries(plan, 0);
        result.and(self.windows.even_out(plan, patches))
    }

    /// Makes a band or a seam.
    fn run_task(&self, grid: &Grid<'_>, part: Part, room: &Room<'_>) -> Result<(), Error> {
        let Kept { bands, seams } = &self.grids[grid.index];
        match part {
            Part::Seam(index) => seams[index].make(|prepared| {
                let seam = Seam::below_band(index, grid.plan.size(grid.index).height);
                let sweep = self.sweep(grid, seam.rows(), room)?;
                self.windows.with(|window| sweep.pass_seam(seam, prepared, window))
            }),
            Part::Band(index) => bands[index].make(|band| {
                let (sweep, beside) = self.band(grid, index, room)?;
                self.windows.with(|window| sweep.pass_band(index, beside, band, window))
            }),
        }
    }

    /// Waits for what a band depends on.
    fn band<'a>(
        &'a self,
        grid: &'a Grid<'a>,
        index: usize,
        room: &'a Room<'a>,
    ) -> Result<(Sweep<'a>, Beside<'a>), Error> {
        let seams = &self.grids[grid.index].seams;
        let wait = |seam: Option<&'a Made<Prepared>>| seam.map(Made::wait).transpose();
        let beside =
            Beside { above: wait(index.checked_sub(1).map(|above| &seams[above]))?, below: wait(seams.get(index))? };
        let rows = band_rows(grid.plan.size(grid.index).height, index);
        Ok((self.sweep(grid, rows, room)?, beside))
    }

    /// Waits for what these rows of a grid need of the coarser one.
    fn sweep<'a>(&'a self, grid: &'a Grid<'a>, rows: Range<usize>, room: &'a Room<'a>) -> Result<Sweep<'a>, Error> {
        let Grid { level, plan, index, layouts, costs } = grid;
        let coarser = layouts.get(index + 1).zip(self.grids.get(index + 1));
        let wait = |(layout, kept): (&'a Layout, &'a Kept)| Coarser::wait(plan, *index, rows, layout, &kept.bands);
        let coarser = coarser.map(wait).transpose()?;
        let gaps = gaps(plan.size(*index).width, plan.settings().cut.map(|cut| cut.x));
        let (level, layout) = (*level, &layouts[*index]);
        Ok(Sweep { level, plan, grid: *index, layout, costs, coarser, gaps, room, updates: &self.updates })
    }

    /// The message entries that the last solve computed.
    pub(crate) fn updates(&self) -> u64 {
        self.updates.load(Ordering::Relaxed)
    }

    /// Memory for each thread.
    pub(crate) fn windows(&self) -> &Windows {
        &self.windows
    }

    /// Copies the labels of a grid where they are decided, `[height][width]`.
    pub(crate) fn read_labels(&self, plan: &Plan, grid: usize, labels: &mut [u16]) {
        let bands = labels.par_chunks_mut(BAND_ROWS * plan.size(grid).width).zip(&self.grids[grid].bands);
        bands.for_each(|(labels, band)| {
            if let Some(band) = band.get() {
                labels.copy_from_slice(&band.labels);
            }
        });
    }

    /// Sweeps all bands of grid 0 again and copies the messages received from `side`, `[height][width][labels]`. Labels that the
    /// receiver's set lacks have zeros, as have all if grid 0 was not swept.
    pub(crate) fn read_messages(&self, grid: &Grid<'_>, side: Side, messages: &mut [u8]) -> Result<(), Error> {
        messages.fill(0);
        if self.grids[grid.index].bands.iter().any(|band| band.get().is_none()) {
            return Ok(());
        }
        // What was swept before needs no more memory.
        let room = Room::new(grid.plan, u64::MAX, 0, 0);
        let row = grid.plan.size(grid.index).width * grid.plan.model().labels();
        messages.par_chunks_mut(BAND_ROWS * row).enumerate().try_for_each(|(index, out)| {
            let (sweep, beside) = self.band(grid, index, &room)?;
            self.windows.with(|window| sweep.read_messages(index, beside, window, side, out))
        })
    }

    /// The bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        self.windows.bytes() + self.grids.iter().map(Kept::bytes).sum::<u64>()
    }
}
