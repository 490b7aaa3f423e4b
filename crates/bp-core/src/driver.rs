//! The driver: runs a prepared plan on one pair after another, calls the kernels in order, and measures their times.

use std::{
    ops::{AddAssign, ControlFlow, Range},
    time::{Duration, Instant},
};

use crate::{
    Device, DisparityMap, Error, IsStopped, Plan, Schedule, Seed, Side, Solver, Stage, StereoPair, census,
    memory::{self, Buffer},
    never,
};

/// The times of one solve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Times {
    /// The wall-clock time of each stage over all grids, in the order of [`Stage::ALL`].
    pub wall: [Duration; Stage::ALL.len()],
    /// The time of each stage by the device's clock, if it has one; see [`Solver::device_times`].
    pub device: Option<[Duration; Stage::ALL.len()]>,
    /// The wall-clock time from images in memory to labels in memory. It includes the census search of a cut plan, which
    /// belongs to no stage.
    pub total: Duration,
}

/// Adds stage by stage. If only one operand has device times, the sum keeps those.
impl AddAssign for Times {
    fn add_assign(&mut self, other: Self) {
        let sum = |a: [Duration; 5], b: [Duration; 5]| std::array::from_fn(|stage| a[stage] + b[stage]);
        self.wall = sum(self.wall, other.wall);
        self.device = match (self.device, other.device) {
            (Some(a), Some(b)) => Some(sum(a, b)),
            (one, other) => one.or(other),
        };
        self.total += other.total;
    }
}

/// The progress of a solve, in message entries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// The entries computed so far.
    pub done: u64,
    /// The entries of the whole plan; see [`Plan::message_updates`].
    pub total: u64,
}

/// A function called before every [`Solver::coarsen`], after every [`Solver::update_messages`], and now and then during
/// [`Solver::pass_messages`], on any thread. If it returns [`ControlFlow::Break`], the solve stops.
pub type Observer<'a> = dyn FnMut(Progress) -> ControlFlow<()> + Send + 'a;

/// A plan prepared on a device, ready to match one pair of its size after another.
pub struct Driver {
    plan: Plan,
    solver: Box<dyn Solver>,
    labels: Buffer<u16>,
    /// Whether the last solve finished, with messages on grid 0.
    has_messages: bool,
}

impl Driver {
    /// Prepares `plan` on `device` and allocates everything it needs.
    ///
    /// # Errors
    /// Those of [`Device::prepare`].
    pub fn new(device: &dyn Device, plan: Plan) -> Result<Self, Error> {
        Self::new_unless(&never, device, plan)
    }

    /// [`Driver::new`] unless it is stopped.
    ///
    /// # Errors
    /// As [`Driver::new`], and [`Error::Stopped`].
    pub fn new_unless(is_stopped: IsStopped<'_>, device: &dyn Device, plan: Plan) -> Result<Self, Error> {
        let start = Instant::now();
        let solver = device.prepare(&plan, is_stopped)?;
        let (size, labels, bytes) = (plan.image_size(), plan.model().labels(), solver.allocated_bytes());
        log::debug!("prepared for {size} pixels and {labels} labels in {:?}, {bytes} bytes", start.elapsed());
        let labels = Buffer::filled_unless(is_stopped, "labels", plan.image_size().pixels(), 0)?;
        Ok(Self { plan, solver, labels, has_messages: false })
    }

    /// The plan.
    #[must_use]
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The bytes actually allocated for the plan.
    #[must_use]
    pub fn allocated_bytes(&self) -> u64 {
        self.solver.allocated_bytes() + self.labels.bytes()
    }

    /// Makes solves fail with [`Error::OutOfMemory`] rather than allocate more than so many bytes in all, where label sets
    /// determine what is needed.
    pub(crate) fn limit_bytes(&mut self, bytes: u64) {
        self.solver.limit_bytes(bytes.saturating_sub(self.labels.bytes()));
    }

    /// The time that [`Driver::new`] spent on compiling kernels, if the device compiles any.
    #[must_use]
    pub fn compile_time(&self) -> Option<Duration> {
        self.solver.compile_time()
    }

    /// The message entries that the last solve computed. Fewer than [`Plan::message_updates`] where the device makes use of
    /// label sets.
    #[must_use]
    pub fn message_updates(&self) -> u64 {
        self.solver.message_updates().unwrap_or_else(|| self.plan.message_updates())
    }

    /// The minimum number of bytes that each stage of the last solve read and wrote, in the order of [`Stage::ALL`], if
    /// the device counts them; see [`Solver::moved_bytes`].
    #[must_use]
    pub fn moved_bytes(&self) -> Option<[u64; Stage::ALL.len()]> {
        self.solver.moved_bytes()
    }

    /// Matches a pair. [`Driver::labels`] and [`Driver::disparities`] hold the result until the next solve.
    ///
    /// # Errors
    /// [`Error::WrongSize`] if the pair does not have the plan's size, and errors of the device.
    pub fn solve(&mut self, pair: &StereoPair) -> Result<Times, Error> {
        self.solve_observed(pair, &mut |_| ControlFlow::Continue(()))
    }

    /// [`Driver::solve`] with an observer, which receives the progress and may stop the solve.
    ///
    /// # Errors
    /// As [`Driver::solve`], and [`Error::Stopped`].
    pub fn solve_observed(&mut self, pair: &StereoPair, observer: &mut Observer<'_>) -> Result<Times, Error> {
        self.solve_run(pair, Run::Cold, observer)
    }

    /// As [`Driver::solve_observed`], but at half the resolution, if grid 1 decides labels in any case ([`Plan::halved`]): the
    /// finest grid, which is most of the work, is left out, and each label of grid 1 counts for all pixels that its node covers.
    /// Disparities are as fine as ever. No messages are left.
    ///
    /// # Errors
    /// As [`Driver::solve_observed`].
    pub fn solve_halved_observed(&mut self, pair: &StereoPair, observer: &mut Observer<'_>) -> Result<Times, Error> {
        self.solve_run(pair, Run::Halved, observer)
    }

    /// Matches the next frame of a video, starting from the messages of the previous frame. The last messages of grid 0
    /// become its first ones, and the plan's steps run on grid 0 only, counted from 0. Without coarser grids such a
    /// solve is faster, but its result is as good only where little has moved. The first solve of a driver, and any
    /// solve after one that stopped or failed, runs as [`Driver::solve_observed`].
    ///
    /// # Errors
    /// As [`Driver::solve_observed`]; [`Error::Plan`] under [`Schedule::Sweep`], whose bands hold messages only while
    /// they are swept, and [`Error::Unsupported`] if the device does not keep the plan's messages.
    pub fn solve_warm_observed(&mut self, pair: &StereoPair, observer: &mut Observer<'_>) -> Result<Times, Error> {
        if self.plan.settings().schedule == Schedule::Sweep {
            return Err(Error::Plan("a warm start needs messages that are kept: the schedule sync or checkerboard"));
        }
        self.solve_run(pair, if self.has_messages { Run::Warm } else { Run::Cold }, observer)
    }

    /// [`Driver::solve_observed`] with a given seed instead of the plan's own.
    ///
    /// # Errors
    /// As [`Driver::solve_observed`].
    pub fn solve_seeded(
        &mut self,
        pair: &StereoPair,
        seed: Option<Seed>,
        observer: &mut Observer<'_>,
    ) -> Result<Times, Error> {
        self.solve_with(pair, |_, _| seed, Run::Cold, observer)
    }

    fn solve_run(&mut self, pair: &StereoPair, run: Run, observer: &mut Observer<'_>) -> Result<Times, Error> {
        self.solve_with(pair, census::seed, run, observer)
    }

    fn solve_with(
        &mut self,
        pair: &StereoPair,
        seed: impl FnOnce(&StereoPair, &Plan) -> Option<Seed>,
        run: Run,
        observer: &mut Observer<'_>,
    ) -> Result<Times, Error> {
        if pair.size() != self.plan.pair_size() {
            let (found, expected) = (pair.size(), self.plan.pair_size());
            return Err(Error::WrongSize { what: "the pair", found, expected });
        }
        self.has_messages = false;
        let Self { plan, solver, labels, .. } = self;
        let mut times = Times::default();
        let start = Instant::now();
        let seed = seed(pair, plan);
        let grids = run.grids(plan);
        let total = grids.clone().map(|grid| plan.grid_updates(grid)).fold(0, u64::saturating_add);
        let mut reports = Reports { observer, total };
        timed(&mut times, Stage::MatchCost, || solver.match_cost(pair, seed))?;
        for grid in 1..grids.end {
            reports.report(0)?;
            timed(&mut times, Stage::Coarsen, || solver.coarsen(grid))?;
        }
        pass_messages(plan, solver.as_mut(), run, &mut times, &mut reports)?;
        let nodes = plan.size(grids.start).pixels();
        timed(&mut times, Stage::SelectLabels, || solver.select_labels(grids.start, &mut labels[..nodes]))?;
        if grids.start > 0 {
            spread(plan, grids.start, labels);
        }
        times.total = start.elapsed();
        times.device = solver.device_times();
        self.has_messages = grids.start == 0;
        log::debug!("solved in {:?}", times.total);
        Ok(times)
    }

    /// The labels of the last solve, `[height][width]`.
    #[must_use]
    pub fn labels(&self) -> &[u16] {
        &self.labels
    }

    /// The disparity map of the last solve. Allocates the map.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn disparities(&self) -> Result<DisparityMap, Error> {
        DisparityMap::from_labels(self.plan.image_size(), self.plan.model(), &self.labels)
    }

    /// The last messages received from `side`; see [`Solver::read_messages`]. Allocates room for them.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`], and errors of the device.
    pub fn messages(&mut self, side: Side) -> Result<Vec<u8>, Error> {
        let mut messages = memory::filled("a copy of the messages", self.plan.volume(0), 0)?;
        self.solver.read_messages(side, &mut messages)?;
        Ok(messages)
    }
}

/// The way of a solve.
#[derive(Clone, Copy)]
enum Run {
    /// Starts with zeros on the coarsest grid.
    Cold,
    /// Starts with the messages that grid 0 already holds.
    Warm,
    /// As [`Self::Cold`], without the finest grid; see [`Plan::halved`].
    Halved,
}

impl Run {
    /// The grids on which messages are passed.
    fn grids(self, plan: &Plan) -> Range<usize> {
        match self {
            Self::Cold => 0..plan.grids(),
            Self::Warm => 0..1,
            Self::Halved => plan.halved()..plan.grids(),
        }
    }
}

/// Spreads the labels of a coarser grid, which come first, over the image. Every label moves towards the end, so those not moved
/// yet are still in place if the last one is moved first.
fn spread(plan: &Plan, grid: usize, labels: &mut [u16]) {
    let (coarse, fine) = (plan.size(grid), plan.image_size());
    for y in (0..fine.height).rev() {
        for x in (0..fine.width).rev() {
            labels[y * fine.width + x] = labels[(y >> grid) * coarse.width + (x >> grid)];
        }
    }
}

/// To whom a solve reports its progress.
struct Reports<'a, 'b> {
    observer: &'a mut Observer<'b>,
    total: u64,
}

impl Reports<'_, '_> {
    /// Reports so many message entries.
    fn observe(&mut self, done: u64) -> ControlFlow<()> {
        (self.observer)(Progress { done: done.min(self.total), total: self.total })
    }

    /// The same, with an error if the solve is to stop.
    fn report(&mut self, done: u64) -> Result<(), Error> {
        if self.observe(done).is_break() { Err(Error::Stopped) } else { Ok(()) }
    }
}

fn pass_messages(
    plan: &Plan,
    solver: &mut dyn Solver,
    run: Run,
    times: &mut Times,
    reports: &mut Reports<'_, '_>,
) -> Result<(), Error> {
    let grids = run.grids(plan);
    let mut is_passed = false;
    timed(times, Stage::UpdateMessages, || {
        is_passed = solver.pass_messages(grids.clone(), &mut |done| reports.observe(done))?;
        Ok(())
    })?;
    if is_passed {
        return reports.report(reports.total);
    }
    let mut done = 0;
    for grid in grids.rev() {
        timed(times, Stage::Refine, || match run {
            Run::Cold | Run::Halved => solver.refine(grid),
            Run::Warm => solver.keep_messages(),
        })?;
        done += plan.seam_updates(grid);
        let mut steps = 0..plan.settings().steps;
        while !steps.is_empty() {
            let end = steps.start.saturating_add(solver.fused_steps()).min(steps.end);
            timed(times, Stage::UpdateMessages, || solver.update_messages(grid, steps.start..end))?;
            done += u64::from(end - steps.start) * plan.updates_per_step(grid);
            steps.start = end;
            reports.report(done)?;
        }
    }
    Ok(())
}

fn timed(times: &mut Times, stage: Stage, run: impl FnOnce() -> Result<(), Error>) -> Result<(), Error> {
    let start = Instant::now();
    run()?;
    times.wall[stage as usize] += start.elapsed();
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Algorithm, Model, Profile, Settings, Size};

    #[test]
    fn each_pixel_has_the_label_of_the_node_that_covers_it() {
        for (width, height) in [(5, 3), (4, 4), (1, 5), (3, 1)] {
            let size = Size { width, height };
            let settings = Algorithm::Sweep.settings(size, 1, 1, Schedule::Sweep);
            let settings = Settings { grids: 2, ..settings };
            let plan = Plan::new(size, Model::new(Profile::Census, 8).unwrap(), settings).unwrap();
            let nodes = plan.size(1);
            let mut labels: Vec<u16> = (0..size.pixels() as u16).collect();
            spread(&plan, 1, &mut labels);
            let covering = |pixel: usize| (pixel / width / 2 * nodes.width + pixel % width / 2) as u16;
            assert_eq!(labels, (0..size.pixels()).map(covering).collect::<Vec<_>>(), "{size}");
        }
    }
}
