//! The order in which threads work through the bands and seams of several grids.
//!
//! Every thread takes the next task of one list, so no thread waits for the slowest band of a grid before the next grid begins.
//! A task waits only for tasks before it in the list. These have all been taken, and whoever took one finishes it without waiting
//! for later ones, so threads cannot wait for each other for ever.

use std::{
    ops::{ControlFlow, Range},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering},
    },
};

use bp_core::{BAND_ROWS, Error, Plan, Seam};

/// A piece of work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Task {
    pub(super) grid: usize,
    pub(super) part: Part,
    /// Its share of the message entries of its grid: that of a band's rows. Seams have none of their own.
    pub(super) updates: u64,
}

/// The band or seam of this index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    Seam(usize),
    Band(usize),
}

/// The tasks of all grids, from the coarsest to the finest. Seams come `ahead` seams before the bands that need them, so that
/// with so many threads they are mostly ready.
pub(super) fn all(plan: &Plan, ahead: usize) -> impl Iterator<Item = Task> + use<'_> {
    (0..plan.grids()).rev().flat_map(move |grid| {
        let height = plan.size(grid).height;
        let (bands, seams) = (height.div_ceil(BAND_ROWS), Seam::all(height).len());
        let updates_a_row = plan.grid_updates(grid) / height as u64;
        let updates = move |part: Part| match part {
            Part::Seam(_) => 0,
            Part::Band(index) => updates_a_row * BAND_ROWS.min(height - index * BAND_ROWS) as u64,
        };
        (0..bands + ahead).flat_map(move |step| {
            let seam = (step < seams).then_some(Part::Seam(step));
            let band = step.checked_sub(ahead).map(Part::Band);
            [seam, band].into_iter().flatten().map(move |part| Task { grid, part, updates: updates(part) })
        })
    })
}

/// Those of some grids. `tasks` begin with the coarsest grid.
pub(super) fn of_grids(tasks: &[Task], grids: Range<usize>) -> &[Task] {
    let finer_than = |grid: usize| tasks.partition_point(|task| task.grid >= grid);
    &tasks[finer_than(grids.end)..finer_than(grids.start)]
}

/// Receives how much has been done; stops the work if it breaks.
pub(crate) type Passed<'a> = dyn FnMut(u64) -> ControlFlow<()> + Send + 'a;

/// Tasks that several threads take one after another.
pub(super) struct Queue<'a> {
    tasks: &'a [Task],
    next: AtomicUsize,
    done: AtomicU64,
    passed: Mutex<&'a mut Passed<'a>>,
    has_failed: AtomicBool,
    result: Mutex<Result<(), Error>>,
}

impl<'a> Queue<'a> {
    pub(super) fn new(tasks: &'a [Task], passed: &'a mut Passed<'a>) -> Self {
        Self {
            tasks,
            next: AtomicUsize::new(0),
            done: AtomicU64::new(0),
            passed: Mutex::new(passed),
            has_failed: AtomicBool::new(false),
            result: Mutex::new(Ok(())),
        }
    }

    /// Takes tasks until there are no more, or one failed.
    pub(super) fn work(&self, run: impl Fn(Task) -> Result<(), Error>) {
        while !self.has_failed.load(Ordering::Relaxed) {
            let Some(&task) = self.tasks.get(self.next.fetch_add(1, Ordering::Relaxed)) else { break };
            match run(task) {
                Ok(()) => self.report(task.updates),
                Err(error) => self.fail(error),
            }
        }
    }

    fn report(&self, done: u64) {
        self.done.fetch_add(done, Ordering::Relaxed);
        // If another thread is reporting, it or a later one reports this, too.
        if let Ok(mut passed) = self.passed.try_lock()
            && passed(self.done.load(Ordering::Relaxed)).is_break()
        {
            self.fail(Error::Stopped);
        }
    }

    /// Keeps the first error, rather than that of a task which waited for another.
    fn fail(&self, error: Error) {
        let mut result = self.result.lock().unwrap_or_else(PoisonError::into_inner);
        if matches!(*result, Ok(()) | Err(Error::Stopped)) {
            *result = Err(error);
        }
        self.has_failed.store(true, Ordering::Relaxed);
    }

    /// How it ended.
    pub(super) fn result(self) -> Result<(), Error> {
        self.result.into_inner().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use bp_core::{Algorithm, Model, Profile, Schedule, Settings, Size};

    use super::*;

    fn plan(height: usize, grids: u32) -> Plan {
        let size = Size { width: 9, height };
        let settings = Settings { grids, ..Algorithm::Sweep.settings(size, 1, 1, Schedule::Sweep) };
        Plan::new(size, Model::new(Profile::Census, 8).unwrap(), settings).unwrap()
    }

    #[test]
    fn seams_come_before_the_bands_beside_them_and_coarser_grids_first() {
        let plan = plan(97, 2);
        let tasks: Vec<_> = all(&plan, 2).map(|task| (task.grid, task.part)).collect();
        let of_grid_0 =
            [Part::Seam(0), Part::Seam(1), Part::Seam(2), Part::Band(0), Part::Band(1), Part::Band(2), Part::Band(3)];
        let of_grid_1 = [Part::Seam(0), Part::Band(0), Part::Band(1)];
        let of_grid_1 = of_grid_1.map(|part| (1, part));
        assert_eq!(tasks, [&of_grid_1[..], &of_grid_0.map(|part| (0, part))].concat());
        let tasks: Vec<_> = all(&plan, 2).collect();
        assert_eq!(of_grids(&tasks, 0..2), tasks);
        assert_eq!(of_grids(&tasks, 1..2), &tasks[..3]);
        assert_eq!(of_grids(&tasks, 0..1), &tasks[3..]);
        // Also where seams are only a little ahead, no task comes before those that it waits for.
        let tasks: Vec<_> = all(&plan, 1).collect();
        let at = |part| tasks.iter().position(|task| (task.grid, task.part) == (0, part));
        assert!((0..3).all(|seam| at(Part::Seam(seam)) < at(Part::Band(seam))));
    }

    #[test]
    fn work_ends_at_the_first_error_which_is_kept() {
        let plan = plan(97, 1);
        let tasks: Vec<_> = all(&plan, 1).collect();
        let mut seen = Vec::new();
        let mut passed = |done| {
            seen.push(done);
            ControlFlow::Continue(())
        };
        let queue = Queue::new(&tasks, &mut passed);
        let run = |task: Task| if task.part == Part::Band(1) { Err(Error::Plan("no")) } else { Ok(()) };
        queue.work(run);
        queue.fail(Error::Stopped);
        assert_eq!(queue.result(), Err(Error::Plan("no")));
        // Two seams, the first band, and the third seam. A band's share is that of its rows.
        let band = plan.grid_updates(0) / 97 * 32;
        assert_eq!(seen, [0, 0, band, band]);
        // A task that waited for another may end before the one that failed.
        let mut passed = |_| ControlFlow::Continue(());
        let queue = Queue::new(&tasks, &mut passed);
        [Error::Stopped, Error::Plan("no")].into_iter().for_each(|error| queue.fail(error));
        assert_eq!(queue.result(), Err(Error::Plan("no")));
        let mut passed = |_| ControlFlow::Break(());
        let queue = Queue::new(&tasks, &mut passed);
        queue.work(|_| Ok(()));
        assert_eq!(queue.result(), Err(Error::Stopped));
    }
}
