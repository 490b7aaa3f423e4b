//! The state of the schedule `sweep` from grid to grid: bands and seams.

use std::{
    ops::{ControlFlow, Range},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
};

use bp_core::{BAND_ROWS, Error, Plan, Seam, Side, memory::Buffer};
use fearless_simd::Level;
use rayon::prelude::*;

use super::{
    Beside, CostSource, Pass, Sweep, Windows,
    coarser::{CoarseBands, Coarser},
    kept::Kept,
    pass::gaps,
    room::{self, Room, most_entries},
    tasks::{self, Part, Passed, Queue, Task, band_rows, coarse_bands, seams_beside},
};
use crate::layout::Layout;

/// What is kept of all grids.
#[derive(Default)]
pub(crate) struct Swept {
    windows: Windows,
    grids: Vec<Kept>,
    tasks: Vec<Task>,
    /// The labels of the finest grid that was swept, by band.
    answer: Vec<Mutex<Buffer<u16>>>,
    /// Whether that is grid 0.
    is_whole: bool,
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

/// Grids of which all parts are made: the bounds of memory, and what is done with a band of the finest one.
struct Run<'a> {
    grids: Range<usize>,
    room: Room<'a>,
    then: &'a (dyn Fn(usize, &Pass<'_>) + Sync),
}

impl Swept {
    /// Allocates everything, except for what label sets make shorter.
    pub(crate) fn new(plan: &Plan) -> Result<Self, Error> {
        if room::swept(plan).is_empty() {
            return Ok(Self::default());
        }
        let (tasks, slots) = tasks::all(plan, rayon::current_num_threads());
        let slots = slots.into_iter().enumerate();
        let grids = slots.map(|(grid, slots)| Kept::new(plan, grid, slots)).collect::<Result<_, _>>()?;
        let mut windows = Windows::new(plan);
        let ([patches, _], [_, entries]) = (most_entries(plan, 0), most_entries(plan, plan.finest_with_all_labels()));
        windows.fit(plan, patches, entries)?;
        let size = plan.image_size();
        let labels =
            |band| Buffer::filled("labels", band_rows(size.height, band).len() * size.width, 0).map(Mutex::new);
        let answer = (0..size.height.div_ceil(BAND_ROWS)).map(labels).collect::<Result<_, _>>()?;
        Ok(Self { windows, grids, tasks, answer, is_whole: false, updates: AtomicU64::new(0) })
    }

    /// Runs all loops on these grids, in no more than `bytes` bytes in all. Calls `passed` with the message entries computed so far,
    /// counted for all labels; stops if it breaks.
    pub(crate) fn run<'a>(
        &mut self,
        plan: &Plan,
        grids: Range<usize>,
        grid: impl Fn(usize) -> Grid<'a> + Sync,
        bytes: u64,
        passed: &mut Passed<'_>,
    ) -> Result<(), Error> {
        self.updates.store(0, Ordering::Relaxed);
        let room = Room::new(plan, bytes, self.bytes(), self.windows.most_entries());
        let finest = grids.start;
        let result = self.work(&Run { grids, room, then: &|_, _| {} }, grid, passed);
        self.is_whole = finest == 0 && result.is_ok();
        let [patches, _] = most_entries(plan, 0);
        result.and(self.windows.even_out(plan, patches))
    }

    /// Lets all threads work through the tasks.
    fn work<'a>(
        &mut self,
        run: &Run<'_>,
        grid: impl Fn(usize) -> Grid<'a> + Sync,
        passed: &mut Passed<'_>,
    ) -> Result<(), Error> {
        self.grids.iter_mut().for_each(Kept::forget);
        let queue = Queue::new(&self.tasks, run.grids.clone(), passed);
        // No more threads than windows, so that none waits for one.
        (0..self.windows.len()).into_par_iter().with_max_len(1).for_each(|_| {
            queue.work(|task| {
                let running = Running(&self.grids);
                self.run_task(&grid(task.grid), task, run)?;
                std::mem::forget(running);
                Ok(())
            });
        });
        queue.result()
    }

    /// Makes a band or a seam, from what it depends on.
    fn run_task(&self, grid: &Grid<'_>, Task { part, readers, .. }: Task, run: &Run<'_>) -> Result<(), Error> {
        let Kept { bands, seams } = &self.grids[grid.index];
        let height = grid.plan.size(grid.index).height;
        let coarser = self.grids.get(grid.index + 1).map(|kept| {
            let coarser_height = grid.plan.size(grid.index + 1).height;
            CoarseBands::read(coarse_bands(part.rows(height), coarser_height), &kept.bands)
        });
        let coarser = coarser.transpose()?;
        let sweep = self.sweep(grid, coarser.as_ref(), &run.room);
        match part {
            Part::Seam(index) => seams.make(index, readers, |prepared| {
                let seam = Seam::below_band(index, height);
                self.windows.with(|window| sweep.pass_seam(seam, prepared, window))
            }),
            Part::Band(index) => {
                let [above, below] = seams_beside(Seam::all(height).len(), index)
                    .map(|seam| seam.map(|seam| seams.read(seam)).transpose());
                let (above, below) = (above?, below?);
                let beside = Beside { above: above.as_deref(), below: below.as_deref() };
                let is_finest = grid.index == run.grids.start;
                let then = |pass: &Pass<'_>| {
                    if is_finest {
                        (run.then)(index, pass)
                    }
                };
                bands.make(index, if is_finest { 0 } else { readers }, |band| {
                    self.windows.with(|window| sweep.pass_band(index, beside, band, window, then))?;
                    if is_finest {
                        self.keep_answer(index, &band.labels, &sweep);
                    }
                    Ok(())
                })
            }
        }
    }

    fn keep_answer(&self, band: usize, labels: &[u16], sweep: &Sweep<'_>) {
        let len = sweep.band_rows(band).len() * sweep.layout.size.width;
        let mut answer = self.answer[band].lock().unwrap_or_else(PoisonError::into_inner);
        answer[..len].copy_from_slice(&labels[..len]);
    }

    fn sweep<'a>(&'a self, grid: &'a Grid<'a>, coarser: Option<&'a CoarseBands<'a>>, room: &'a Room<'a>) -> Sweep<'a> {
        let Grid { level, plan, index, layouts, costs } = grid;
        let coarser = coarser.map(|bands| Coarser::new(&layouts[index + 1], plan.model().edges(), bands));
        let gaps = gaps(plan.size(*index).width, plan.settings().cut.map(|cut| cut.x));
        let (level, layout) = (*level, &layouts[*index]);
        Sweep { level, plan, grid: *index, layout, costs, coarser, gaps, room, updates: &self.updates }
    }

    /// Forgets the answer: there is another pair.
    pub(crate) fn forget(&mut self) {
        self.is_whole = false;
    }

    /// The message entries that the last solve computed.
    pub(crate) fn updates(&self) -> u64 {
        self.updates.load(Ordering::Relaxed)
    }

    /// Memory for each thread.
    pub(crate) fn windows(&self) -> &Windows {
        &self.windows
    }

    /// Copies the labels of the finest grid that was swept, `[height][width]`.
    pub(crate) fn read_labels(&self, plan: &Plan, grid: usize, labels: &mut [u16]) {
        let bands = labels.par_chunks_mut(BAND_ROWS * plan.size(grid).width).zip(&self.answer);
        bands.for_each(|(labels, band)| {
            labels.copy_from_slice(&band.lock().unwrap_or_else(PoisonError::into_inner)[..labels.len()]);
        });
    }

    /// Sweeps once more and copies the messages received from `side`, `[height][width][labels]`. Labels that the receiver's set
    /// lacks have zeros, as have all if grid 0 was not swept.
    pub(crate) fn read_messages<'a>(
        &mut self,
        plan: &Plan,
        grid: impl Fn(usize) -> Grid<'a> + Sync,
        side: Side,
        messages: &mut [u8],
    ) -> Result<(), Error> {
        messages.fill(0);
        if !self.is_whole {
            return Ok(());
        }
        let row = plan.size(0).width * plan.model().labels();
        let bands: Vec<_> = messages.chunks_mut(BAND_ROWS * row).map(Mutex::new).collect();
        let read = |band: usize, pass: &Pass<'_>| {
            pass.read_messages(side, &mut bands[band].lock().unwrap_or_else(PoisonError::into_inner));
        };
        // What was swept before needs no more memory.
        let room = Room::new(plan, u64::MAX, 0, 0);
        let updates = self.updates();
        let run = Run { grids: room::swept(plan), room, then: &read };
        let result = self.work(&run, grid, &mut |_| ControlFlow::Continue(()));
        self.updates.store(updates, Ordering::Relaxed);
        result
    }

    /// The bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        let bytes = |labels: &Mutex<Buffer<u16>>| labels.lock().unwrap_or_else(PoisonError::into_inner).bytes();
        let answer: u64 = self.answer.iter().map(bytes).sum();
        self.windows.bytes() + answer + self.grids.iter().map(Kept::bytes).sum::<u64>()
    }
}

/// A task while it runs. If it fails, or panics, nobody waits any more for what it makes.
struct Running<'a>(&'a [Kept]);

impl Drop for Running<'_> {
    fn drop(&mut self) {
        self.0.iter().for_each(Kept::fail);
    }
}
