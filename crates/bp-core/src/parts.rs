//! The parts of an image that is cut, each with a plan of its own.

use std::{
    ops::{ControlFlow, Range},
    sync::{Mutex, PoisonError},
    time::Instant,
};

use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

use crate::{
    Device, Driver, Error, IsStopped, Plan, Profile, Schedule, Seed, Settings, Size, StereoPair, Times, census,
    memory::Buffer,
};

/// A part of a cut image with a plan of its own. No message crosses the cut, so its messages and labels are the same bits as
/// those that the plan of the whole image gives its nodes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    columns: Range<usize>,
    rows: Range<usize>,
    plan: Plan,
}

impl Part {
    /// The parts of a plan with a cut, from top left to bottom right: four, or fewer if the cut runs along a border.
    ///
    /// # Errors
    /// [`Error::Plan`] without a cut; with another schedule than [`Schedule::Sync`]; with negative disparities; and with a
    /// profile that compares neighbours, which may lie across the cut.
    pub fn all(whole: &Plan) -> Result<Vec<Self>, Error> {
        let settings = whole.settings();
        let cut = settings.cut.ok_or(Error::Plan("only an image that is cut has parts"))?;
        if settings.schedule != Schedule::Sync {
            return Err(Error::Plan("parts with plans of their own need the schedule sync"));
        }
        if whole.model().min_disparity() < 0 {
            return Err(Error::Plan("parts with plans of their own need disparities from 0 on"));
        }
        if !matches!(whole.model().profile(), Profile::Thesis | Profile::Mrf) {
            return Err(Error::Plan("parts with plans of their own need a profile of single pixels: thesis or mrf"));
        }
        let Size { width, height } = whole.image_size();
        let columns = [0..cut.x, cut.x..width].into_iter().filter(|columns| !columns.is_empty());
        let rows = [0..cut.y, cut.y..height].into_iter().filter(|rows| !rows.is_empty());
        let parts = rows.flat_map(|rows| columns.clone().map(move |columns| (columns, rows.clone())));
        parts.map(|(columns, rows)| Self::new(whole, columns, rows)).collect()
    }

    fn new(whole: &Plan, columns: Range<usize>, rows: Range<usize>) -> Result<Self, Error> {
        let size = Size { width: columns.len(), height: rows.len() };
        let model = *whole.model();
        let farthest = model.disparity(model.labels() as u16 - 1);
        let margin = columns.start.min(usize::try_from(farthest).unwrap_or(0));
        let plan = Plan::new(size, model, Settings { cut: None, ..*whole.settings() })?;
        Ok(Self { columns, rows, plan: plan.with_margin(margin)? })
    }

    /// Its plan, for its nodes only.
    #[must_use]
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Its rows.
    #[must_use]
    pub fn rows(&self) -> Range<usize> {
        self.rows.clone()
    }

    /// Its columns.
    #[must_use]
    pub fn columns(&self) -> Range<usize> {
        self.columns.clone()
    }

    /// Its rows and columns of a pair, with the columns to the left that its nodes match in the right image.
    ///
    /// # Panics
    /// If the pair is smaller than the whole plan's.
    #[must_use]
    pub fn pair(&self, pair: &StereoPair) -> StereoPair {
        pair.part(self.columns.start - self.plan.margin()..self.columns.end, self.rows.clone())
    }

    /// A seed of the whole image in the coordinates of its nodes; `None` if it lies above or to the left of them.
    #[must_use]
    pub fn seed(&self, seed: Seed) -> Option<Seed> {
        let x = seed.x.checked_sub(self.columns.start)?;
        Some(Seed { x, y: seed.y.checked_sub(self.rows.start)?, ..seed })
    }

    /// Solves it on its own driver.
    fn solve(
        &self,
        driver: &mut Driver,
        pair: &StereoPair,
        seed: Option<Seed>,
        is_stopped: IsStopped<'_>,
    ) -> Result<Times, Error> {
        let stop = |_| if is_stopped() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
        driver.solve_seeded(&self.pair(pair), seed.and_then(|seed| self.seed(seed)), &mut { stop })
    }

    /// Copies its labels to those of the whole image, `[height][width]`.
    fn give(&self, labels: &[u16], width: usize, whole: &mut [u16]) {
        for (y, labels) in self.rows.clone().zip(labels.chunks_exact(self.columns.len())) {
            whole[y * width..][self.columns.clone()].copy_from_slice(labels);
        }
    }
}

/// How the parts of an image share the machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Parting {
    /// Each part on a worker of its own, which takes the next part when it is done. Every worker has one thread.
    SideBySide {
        /// The number of workers, at least 1.
        workers: usize,
    },
    /// One after another in the memory of one part, with all threads.
    InTurn,
}

/// Matches pairs of images part by part.
pub struct PartDriver {
    whole: Plan,
    parts: Vec<Part>,
    parting: Parting,
    /// The drivers of all parts, or that of the last part.
    drivers: Vec<Driver>,
    /// A pool of one thread for each worker.
    pools: Vec<ThreadPool>,
    most_bytes: u64,
    labels: Buffer<u16>,
}

impl PartDriver {
    /// Allocates everything for a plan with a cut: all parts side by side, or the first part.
    ///
    /// # Errors
    /// Those of [`Part::all`] and [`Device::prepare`].
    pub fn new(device: &dyn Device, whole: Plan, parting: Parting) -> Result<Self, Error> {
        let parts = Part::all(&whole)?;
        let prepared = if parting == Parting::InTurn { &parts[..1] } else { &parts };
        let drivers =
            prepared.iter().map(|part| Driver::new(device, part.plan.clone())).collect::<Result<Vec<_>, _>>()?;
        let pools = match parting {
            Parting::SideBySide { workers } => (0..workers.clamp(1, parts.len())).map(|_| pool()).collect(),
            Parting::InTurn => Ok(Vec::new()),
        };
        let labels = Buffer::filled("labels", whole.image_size().pixels(), 0)?;
        let most_bytes = drivers.iter().map(Driver::allocated_bytes).sum();
        Ok(Self { whole, parts, parting, drivers, pools: pools?, most_bytes, labels })
    }

    /// The bytes that a device will allocate for a plan with a cut.
    ///
    /// # Errors
    /// Those of [`Part::all`].
    pub fn planned_bytes(device: &dyn Device, whole: &Plan, parting: Parting) -> Result<u64, Error> {
        let parts = Part::all(whole)?;
        let bytes = parts.iter().map(|part| device.planned_bytes(&part.plan));
        let of_parts = match parting {
            Parting::SideBySide { .. } => bytes.fold(0, u64::saturating_add),
            Parting::InTurn => bytes.max().unwrap_or(0),
        };
        let labels = size_of::<u16>() * whole.image_size().pixels();
        Ok(of_parts.saturating_add(labels as u64))
    }

    /// The most bytes that were allocated at a time.
    #[must_use]
    pub fn allocated_bytes(&self) -> u64 {
        self.most_bytes + self.labels.bytes()
    }

    /// The labels of the last solve, `[height][width]`.
    #[must_use]
    pub fn labels(&self) -> &[u16] {
        &self.labels
    }

    /// Matches a pair on the device that it was prepared for, where parts in turn are prepared one by one. Times of stages are sums over the parts, whichever of them ran at the same time.
    ///
    /// # Errors
    /// [`Error::WrongSize`] if the pair does not have the plan's size, errors of the device, [`Error::OutOfMemory`], and
    /// [`Error::Stopped`].
    pub fn solve(&mut self, device: &dyn Device, pair: &StereoPair, is_stopped: IsStopped<'_>) -> Result<Times, Error> {
        if pair.size() != self.whole.image_size() {
            let (found, expected) = (pair.size(), self.whole.image_size());
            return Err(Error::WrongSize { what: "the pair", found, expected });
        }
        let start = Instant::now();
        let seed = census::seed(pair, &self.whole);
        let times = match self.parting {
            Parting::SideBySide { .. } => self.solve_side_by_side(pair, seed, is_stopped)?,
            Parting::InTurn => self.solve_in_turn(device, pair, seed, is_stopped)?,
        };
        Ok(Times { total: start.elapsed(), ..times })
    }

    fn solve_side_by_side(
        &mut self,
        pair: &StereoPair,
        seed: Option<Seed>,
        is_stopped: IsStopped<'_>,
    ) -> Result<Times, Error> {
        let queue = Mutex::new(self.parts.iter().zip(&mut self.drivers));
        let work = || {
            let mut times = Times::default();
            // The lock is held only while the next part is taken.
            let next = || queue.lock().unwrap_or_else(PoisonError::into_inner).next();
            while let Some((part, driver)) = next() {
                times += part.solve(driver, pair, seed, is_stopped)?;
            }
            Ok(times)
        };
        let times = on_all(&self.pools, &work)?;
        let width = self.whole.image_size().width;
        for (part, driver) in self.parts.iter().zip(&self.drivers) {
            part.give(driver.labels(), width, &mut self.labels);
        }
        Ok(times)
    }

    fn solve_in_turn(
        &mut self,
        device: &dyn Device,
        pair: &StereoPair,
        seed: Option<Seed>,
        is_stopped: IsStopped<'_>,
    ) -> Result<Times, Error> {
        let (width, mut times) = (self.whole.image_size().width, Times::default());
        for part in &self.parts {
            if self.drivers.first().is_none_or(|driver| *driver.plan() != part.plan) {
                // The old one goes before the new one comes: there is room for one.
                self.drivers.clear();
                self.drivers.push(Driver::new_unless(is_stopped, device, part.plan.clone())?);
            }
            let driver = &mut self.drivers[0];
            times += part.solve(driver, pair, seed, is_stopped)?;
            self.most_bytes = self.most_bytes.max(driver.allocated_bytes());
            part.give(driver.labels(), width, &mut self.labels);
        }
        Ok(times)
    }
}

fn pool() -> Result<ThreadPool, Error> {
    let failed = |error: ThreadPoolBuildError| Error::Device { device: "CPU".to_owned(), reason: error.to_string() };
    ThreadPoolBuilder::new().num_threads(1).build().map_err(failed)
}

/// Does some work in every pool at the same time, and adds up the times.
fn on_all(pools: &[ThreadPool], work: &(impl Fn() -> Result<Times, Error> + Sync)) -> Result<Times, Error> {
    let Some((pool, others)) = pools.split_first() else { return Ok(Times::default()) };
    let (mut times, mut of_others) = (Ok(Times::default()), Ok(Times::default()));
    pool.in_place_scope(|scope| {
        scope.spawn(|_| times = work());
        of_others = on_all(others, work);
    });
    let mut sum = times?;
    sum += of_others?;
    Ok(sum)
}
