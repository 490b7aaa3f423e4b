//! The driver: runs a prepared plan on pair after pair, in the one order that all backends follow, and times it.

use std::{
    ops::{AddAssign, ControlFlow},
    time::{Duration, Instant},
};

use crate::{Device, DisparityMap, Error, Plan, Side, Solver, StereoPair, census, memory};

/// A timed stage: the kernel of the same name, over all grids.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Stage {
    /// Data costs of the image.
    MatchCost,
    /// Data costs of the coarser grids.
    Coarsen,
    /// First messages of every grid.
    Refine,
    /// Message passing.
    UpdateMessages,
    /// Labels of least belief.
    SelectLabels,
}

impl Stage {
    /// All stages, in the order in which they first run.
    pub const ALL: [Self; 5] = [Self::MatchCost, Self::Coarsen, Self::Refine, Self::UpdateMessages, Self::SelectLabels];

    /// The name of stage and kernel.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::MatchCost => "match_cost",
            Self::Coarsen => "coarsen",
            Self::Refine => "refine",
            Self::UpdateMessages => "update_messages",
            Self::SelectLabels => "select_labels",
        }
    }
}

/// Times of one solve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Times {
    /// Each stage over all grids by the wall clock, in the order of [`Stage::ALL`].
    pub wall: [Duration; Stage::ALL.len()],
    /// The same by the device's clock, where it has one; see [`Solver::device_times`].
    pub device: Option<[Duration; Stage::ALL.len()]>,
    /// From the images in memory to the labels in memory; the census search of a cut plan is in here and in no stage. Wall clock.
    pub total: Duration,
}

/// Adds stage by stage; where only one has the device's clock, its times stand.
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

/// How far a solve has come, in message entries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Computed so far.
    pub done: u64,
    /// Of the whole plan, as predicted by [`Plan::message_updates`].
    pub total: u64,
}

/// Called after every call of [`Solver::update_messages`]; breaking stops the solve.
pub type Observer<'a> = dyn FnMut(Progress) -> ControlFlow<()> + 'a;

/// A plan prepared on a device, ready to match pairs of its size one after another.
pub struct Matcher {
    plan: Plan,
    solver: Box<dyn Solver>,
    labels: Vec<u16>,
}

impl Matcher {
    /// Prepares `plan` on `device`; everything is allocated here.
    ///
    /// # Errors
    /// Those of [`Device::prepare`].
    pub fn new(device: &dyn Device, plan: Plan) -> Result<Self, Error> {
        let solver = device.prepare(&plan)?;
        let labels = memory::filled("labels", plan.image_size().pixels(), 0)?;
        Ok(Self { plan, solver, labels })
    }

    /// The plan.
    #[must_use]
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Bytes allocated for the plan, counted.
    #[must_use]
    pub fn allocated_bytes(&self) -> u64 {
        self.solver.allocated_bytes() + memory::bytes(&self.labels)
    }

    /// Time that compiling kernels took within [`Matcher::new`], where the device compiles any.
    #[must_use]
    pub fn compile_time(&self) -> Option<Duration> {
        self.solver.compile_time()
    }

    /// Bytes that each stage of the last match had to read and write at least, in the order of [`Stage::ALL`], where
    /// the device counts them; see [`Solver::moved_bytes`].
    #[must_use]
    pub fn moved_bytes(&self) -> Option<[u64; Stage::ALL.len()]> {
        self.solver.moved_bytes()
    }

    /// Matches a pair; [`Matcher::labels`] and [`Matcher::disparities`] hold the answer until the next.
    ///
    /// # Errors
    /// [`Error::WrongSize`] where the pair is not of the plan's size, and those of the device.
    pub fn solve(&mut self, pair: &StereoPair) -> Result<Times, Error> {
        self.solve_observed(pair, &mut |_| ControlFlow::Continue(()))
    }

    /// The same, with an observer that is told of progress and may stop it.
    ///
    /// # Errors
    /// As [`Matcher::solve`], and [`Error::Stopped`].
    pub fn solve_observed(&mut self, pair: &StereoPair, observer: &mut Observer<'_>) -> Result<Times, Error> {
        if pair.size() != self.plan.image_size() {
            let (found, expected) = (pair.size(), self.plan.image_size());
            return Err(Error::WrongSize { what: "the pair", found, expected });
        }
        let Self { plan, solver, labels } = self;
        let mut times = Times::default();
        let start = Instant::now();
        let seed = plan.settings().cut.filter(|cut| cut.seed_start);
        let seed = seed.and_then(|cut| census::find_match(pair, plan.model(), (cut.x, cut.y)));
        timed(&mut times, Stage::MatchCost, || solver.match_cost(pair, seed))?;
        for grid in 1..plan.grids() {
            timed(&mut times, Stage::Coarsen, || solver.coarsen(grid))?;
        }
        pass_messages(plan, solver.as_mut(), &mut times, observer)?;
        timed(&mut times, Stage::SelectLabels, || solver.select_labels(labels))?;
        times.total = start.elapsed();
        times.device = solver.device_times();
        Ok(times)
    }

    /// The last answer: a label for every pixel, `[height][width]`.
    #[must_use]
    pub fn labels(&self) -> &[u16] {
        &self.labels
    }

    /// The last answer in pixels; allocates the map.
    #[must_use]
    pub fn disparities(&self) -> DisparityMap {
        DisparityMap::from_labels(self.plan.image_size(), self.plan.model(), &self.labels)
    }

    /// The last messages received from `side`, see [`Solver::read_messages`]; allocates the volume.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`], and those of the device.
    pub fn messages(&mut self, side: Side) -> Result<Vec<u8>, Error> {
        let mut messages = memory::filled("a copy of the messages", self.plan.volume(0), 0)?;
        self.solver.read_messages(side, &mut messages)?;
        Ok(messages)
    }
}

fn pass_messages(
    plan: &Plan,
    solver: &mut dyn Solver,
    times: &mut Times,
    observer: &mut Observer<'_>,
) -> Result<(), Error> {
    let mut progress = Progress { done: 0, total: plan.message_updates() };
    for grid in (0..plan.grids()).rev() {
        timed(times, Stage::Refine, || solver.refine(grid))?;
        let mut steps = 0..plan.settings().steps;
        while !steps.is_empty() {
            let end = steps.start.saturating_add(solver.fused_steps()).min(steps.end);
            timed(times, Stage::UpdateMessages, || solver.update_messages(grid, steps.start..end))?;
            progress.done += u64::from(end - steps.start) * plan.updates_per_step(grid);
            steps.start = end;
            if observer(progress).is_break() {
                return Err(Error::Stopped);
            }
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
