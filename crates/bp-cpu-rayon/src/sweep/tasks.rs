//! The order in which threads work through the bands and seams of several grids.
//!
//! Every thread takes the next task of one list, so no thread waits for the slowest band of a grid before the next grid begins.
//! The list goes down the image on all grids at the same time, a coarse grid a little ahead of the next finer one. So a band is
//! needed for a short time only, and then the next one takes its memory ([`Slots`](super::slots::Slots)). A task waits only for
//! tasks before it in the list. These have all been taken, and whoever took one finishes it without waiting for later ones, so
//! threads cannot wait for each other for ever.

use std::{
    ops::{ControlFlow, Range, RangeInclusive},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering},
    },
};

use bp_core::{BAND_ROWS, Error, Patch, Plan, Seam, Size};

/// A piece of work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Task {
    pub(super) grid: usize,
    pub(super) part: Part,
    /// Its share of the message entries of its grid: that of a band's rows. Seams have none of their own.
    pub(super) updates: u64,
    /// How many tasks read its result. Tasks of the next finer grid read a band; the two bands beside a seam read the seam.
    pub(super) readers: usize,
}

/// The band or seam of this index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    Seam(usize),
    Band(usize),
}

impl Part {
    /// Its rows of a grid with this many.
    pub(super) fn rows(self, height: usize) -> Range<usize> {
        match self {
            Self::Seam(index) => Seam::below_band(index, height).rows(),
            Self::Band(index) => band_rows(height, index),
        }
    }
}

/// The rows of a band of a grid with this many rows.
pub(super) fn band_rows(height: usize, band: usize) -> Range<usize> {
    BAND_ROWS * band..height.min(BAND_ROWS * (band + 1))
}

/// The bands of the next coarser grid that rows of a grid depend on: for their label sets, and for first messages, which need fewer
/// rows. The coarser grid has so many rows.
pub(super) fn coarse_bands(rows: Range<usize>, coarser_height: usize) -> RangeInclusive<usize> {
    let region = Patch { columns: 0..1, rows }.region(Size { width: 1, height: coarser_height });
    region.rows.start / BAND_ROWS..=(region.rows.end - 1) / BAND_ROWS
}

/// The seams beside a band of a grid with so many: above and below.
pub(super) fn seams_beside(seams: usize, band: usize) -> [Option<usize>; 2] {
    [band.checked_sub(1), Some(band).filter(|&below| below < seams)]
}

/// The tasks of all grids, which keep so many threads busy, and in how many slots the bands and the seams of every grid fit.
pub(super) fn all(plan: &Plan, threads: usize) -> (Vec<Task>, Vec<[usize; 2]>) {
    let heights = heights(plan);
    let updates_a_row: Vec<_> =
        heights.iter().enumerate().map(|(grid, &height)| plan.grid_updates(grid) / height as u64).collect();
    let order = order(&heights, threads);
    let mut places = Places::of(&heights, &order);
    let task = |&(grid, part): &(usize, Part)| {
        let updates = match part {
            Part::Seam(_) => 0,
            Part::Band(_) => updates_a_row[grid] * part.rows(heights[grid]).len() as u64,
        };
        Task { grid, part, updates, readers: places.at(grid, part).readers }
    };
    let tasks = order.iter().map(task).collect();
    (tasks, places.slots(threads))
}

/// The slots that [`all`] will find, for predictions, which must not take long for images of millions of rows. High images need
/// no more slots than those where the list has begun to repeat itself.
pub(super) fn predicted_slots(plan: &Plan, threads: usize) -> Vec<[usize; 2]> {
    let mut heights = heights(plan);
    let coarsest = heights.len() - 1;
    let bands = 3 * threads + 8;
    heights[0] = heights[0].min(bands.saturating_mul(BAND_ROWS).saturating_mul(1 << coarsest.min(31)));
    (1..=coarsest).for_each(|grid| heights[grid] = heights[grid - 1].div_ceil(2));
    Places::of(&heights, &order(&heights, threads)).slots(threads)
}

fn heights(plan: &Plan) -> Vec<usize> {
    (0..plan.grids()).map(|grid| plan.size(grid).height).collect()
}

/// The number of bands of a grid, and of the seams between them.
fn counts(height: usize) -> [usize; 2] {
    [height.div_ceil(BAND_ROWS), Seam::all(height).len()]
}

/// The bands and seams of grids with so many rows. On every grid, seams come `ahead` seams before the bands that need them, and bands `ahead`
/// bands before those of the next finer grid, so that with so many threads they are mostly ready.
fn order(heights: &[usize], ahead: usize) -> Vec<(usize, Part)> {
    let mut order = Vec::with_capacity(heights.iter().map(|&height| counts(height).iter().sum::<usize>()).sum());
    let mut listed = vec![[0, 0]; heights.len()];
    let mut wanted = vec![0; heights.len()];
    for bands in 1..=counts(heights[0])[0] {
        want(heights, bands, ahead, &mut wanted);
        for grid in (0..heights.len()).rev() {
            let ([bands, seams], [_, all_seams]) = (&mut listed[grid], counts(heights[grid]));
            while *bands < wanted[grid] {
                while *seams < all_seams.min(*bands + 1 + ahead) {
                    order.push((grid, Part::Seam(*seams)));
                    *seams += 1;
                }
                order.push((grid, Part::Band(*bands)));
                *bands += 1;
            }
        }
    }
    order
}

/// Finds how many bands of every grid are listed before so many of grid 0.
fn want(heights: &[usize], bands: usize, ahead: usize, wanted: &mut [usize]) {
    wanted[0] = bands;
    for (grid, pair) in heights.windows(2).enumerate() {
        let ([bands, seams], [coarse_bands_there, _]) = (counts(pair[0]), counts(pair[1]));
        // The last seam listed reaches farther down than the last band.
        let last = bands.min(wanted[grid] + ahead) - 1;
        let part = if last < seams { Part::Seam(last) } else { Part::Band(last) };
        let needed = coarse_bands(part.rows(pair[0]), pair[1]).end() + 1;
        wanted[grid + 1] = coarse_bands_there.min(needed + ahead);
    }
}

/// What a task reads.
fn needs(heights: &[usize], (grid, part): (usize, Part)) -> impl Iterator<Item = (usize, Part)> + use<> {
    let height = heights[grid];
    let seams = match part {
        Part::Seam(_) => [None; 2],
        Part::Band(index) => seams_beside(counts(height)[1], index),
    };
    let bands = heights.get(grid + 1).map(|&coarser| coarse_bands(part.rows(height), coarser));
    let seams = seams.into_iter().flatten().map(move |index| (grid, Part::Seam(index)));
    seams.chain(bands.into_iter().flatten().map(move |index| (grid + 1, Part::Band(index))))
}

/// Where each band and seam of each grid is in the list, and where the last task that reads it is.
struct Places {
    of: Vec<[Vec<Place>; 2]>,
}

#[derive(Clone, Copy, Default)]
struct Place {
    made: usize,
    read: usize,
    readers: usize,
}

impl Places {
    fn of(heights: &[usize], order: &[(usize, Part)]) -> Self {
        let none = |&height: &usize| counts(height).map(|count| vec![Place::default(); count]);
        let mut places = Self { of: heights.iter().map(none).collect() };
        for (at, &(grid, part)) in order.iter().enumerate() {
            *places.at(grid, part) = Place { made: at, read: at, readers: 0 };
            for (grid, part) in needs(heights, (grid, part)) {
                let place = places.at(grid, part);
                (place.read, place.readers) = (at, place.readers + 1);
            }
        }
        places
    }

    fn at(&mut self, grid: usize, part: Part) -> &mut Place {
        match part {
            Part::Band(index) => &mut self.of[grid][0][index],
            Part::Seam(index) => &mut self.of[grid][1][index],
        }
    }

    /// In how many slots they fit. A slot is free `ahead` tasks before the next one to take it.
    fn slots(&self, ahead: usize) -> Vec<[usize; 2]> {
        let needed = |places: &Vec<Place>| {
            let taken = places.iter().enumerate().map(|(index, place)| {
                places.partition_point(|next| next.made <= place.read + ahead).max(index + 1) - index
            });
            taken.max().unwrap_or(0)
        };
        self.of.iter().map(|of| of.each_ref().map(needed)).collect()
    }
}

/// Receives how much has been done; stops the work if it breaks.
pub(crate) type Passed<'a> = dyn FnMut(u64) -> ControlFlow<()> + Send + 'a;

/// Tasks that several threads take one after another.
pub(super) struct Queue<'a> {
    tasks: &'a [Task],
    /// The grids whose tasks are taken.
    grids: Range<usize>,
    next: AtomicUsize,
    done: AtomicU64,
    passed: Mutex<&'a mut Passed<'a>>,
    has_failed: AtomicBool,
    result: Mutex<Result<(), Error>>,
}

impl<'a> Queue<'a> {
    pub(super) fn new(tasks: &'a [Task], grids: Range<usize>, passed: &'a mut Passed<'a>) -> Self {
        Self {
            tasks,
            grids,
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
            if !self.grids.contains(&task.grid) {
                continue;
            }
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
    fn tasks_come_after_what_they_need_and_before_its_memory_is_taken() {
        for (height, grids, ahead) in
            [(97, 2, 1), (97, 1, 2), (1000, 5, 1), (1000, 5, 3), (33, 4, 8), (2049, 6, 2), (5, 3, 1)]
        {
            let plan = plan(height, grids);
            let (heights, (tasks, slots)) = (heights(&plan), all(&plan, ahead));
            assert_eq!(tasks.len(), heights.iter().map(|&height| counts(height).iter().sum::<usize>()).sum());
            // The index of what lies in each slot, and how many have not read it.
            let mut held: Vec<_> = slots.iter().map(|slots| slots.map(|slots| vec![(usize::MAX, 0); slots])).collect();
            for task in &tasks {
                for (grid, part) in needs(&heights, (task.grid, task.part)) {
                    let (index, of) = of_part(&mut held[grid], part);
                    assert_eq!(of.0, index, "{task:?} needs {part:?} of grid {grid}: {height}, {grids}, {ahead}");
                    of.1 -= 1;
                }
                let (index, of) = of_part(&mut held[task.grid], task.part);
                assert_eq!(of.1, 0, "{task:?} takes what others need");
                *of = (index, task.readers);
            }
            assert!(held.iter().flatten().flatten().all(|&(_, readers)| readers == 0));
        }
    }

    /// The index of a part, and its slot.
    fn of_part(slots: &mut [Vec<(usize, usize)>; 2], part: Part) -> (usize, &mut (usize, usize)) {
        let [bands, seams] = slots;
        let (slots, index) = match part {
            Part::Band(index) => (bands, index),
            Part::Seam(index) => (seams, index),
        };
        let slot = index % slots.len();
        (index, &mut slots[slot])
    }

    #[test]
    fn a_high_image_needs_no_more_memory_and_predictions_know_that() {
        for (threads, grids) in [(1, 5), (2, 5), (5, 5), (12, 5), (8, 6), (16, 3), (32, 4)] {
            for height in [31, 100, 700, 3000, 5001, 9000, 16_385, 20_033, 24_705, 60_001] {
                let plan = plan(height, grids);
                let (_, slots) = all(&plan, threads);
                assert_eq!(predicted_slots(&plan, threads), slots, "{height} rows, {threads} threads, {grids} grids");
                assert!(slots.iter().flatten().all(|&slots| slots <= 3 * threads + 8), "{slots:?}");
            }
        }
    }

    #[test]
    fn work_ends_at_the_first_error_which_is_kept() {
        let plan = plan(97, 1);
        let (tasks, _) = all(&plan, 1);
        let mut seen = Vec::new();
        let mut passed = |done| {
            seen.push(done);
            ControlFlow::Continue(())
        };
        let queue = Queue::new(&tasks, 0..1, &mut passed);
        let run = |task: Task| if task.part == Part::Band(1) { Err(Error::Plan("no")) } else { Ok(()) };
        queue.work(run);
        queue.fail(Error::Stopped);
        assert_eq!(queue.result(), Err(Error::Plan("no")));
        // Two seams, the first band, and the third seam. A band's share is that of its rows.
        let band = plan.grid_updates(0) / 97 * 32;
        assert_eq!(seen, [0, 0, band, band]);
        // A task that waited for another may end before the one that failed.
        let mut passed = |_| ControlFlow::Continue(());
        let queue = Queue::new(&tasks, 0..1, &mut passed);
        [Error::Stopped, Error::Plan("no")].into_iter().for_each(|error| queue.fail(error));
        assert_eq!(queue.result(), Err(Error::Plan("no")));
        let mut passed = |_| ControlFlow::Break(());
        let queue = Queue::new(&tasks, 0..1, &mut passed);
        queue.work(|_| Ok(()));
        assert_eq!(queue.result(), Err(Error::Stopped));
    }
}
