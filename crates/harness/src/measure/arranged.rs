//! Plans that arrange the workers otherwise, prepared and timed.

use std::time::Instant;

use bp_core::{PartDriver, Parting, Plan, StereoPair};
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::{Meter, Runner, Solve};
use crate::{
    failure::Failure,
    machine,
    record::{Arrangement, Sample, milliseconds},
};

/// A prepared plan in some arrangement.
pub enum Arranged<'a> {
    /// The whole image, on all workers or, with a pool of its own, on one.
    Whole(Box<Solve<'a>>, Option<ThreadPool>),
    /// The parts of a cut image.
    Parts(Box<Parts<'a>>),
}

/// The parts of a cut image, prepared, and the pair that they are solved for.
pub struct Parts<'a> {
    runner: &'a Runner,
    pair: &'a StereoPair,
    driver: PartDriver,
    prepare_ms: f64,
}

impl<'a> Arranged<'a> {
    /// Prepares a plan.
    pub fn prepare(
        runner: &'a Runner,
        plan: Plan,
        pair: &'a StereoPair,
        arrangement: Option<Arrangement>,
    ) -> Result<Self, Failure> {
        match arrangement {
            None => Ok(Self::Whole(Box::new(Solve::prepare(runner, plan, pair)?), None)),
            Some(Arrangement::OneWorker) => {
                let failed = |error| Failure::other(format!("cannot start a thread: {error}"));
                let pool = ThreadPoolBuilder::new().num_threads(1).build().map_err(failed)?;
                let solve = pool.install(|| Solve::prepare(runner, plan, pair))?;
                Ok(Self::Whole(Box::new(solve), Some(pool)))
            }
            Some(Arrangement::SideBySide { workers }) => {
                Parts::prepare(runner, plan, pair, Parting::SideBySide { workers })
            }
            Some(Arrangement::InTurn) => Parts::prepare(runner, plan, pair, Parting::InTurn),
        }
    }

    /// Solves it once.
    pub fn sample(&mut self, round: u32, meter: &Meter<'_>) -> Result<Sample, Failure> {
        let (prepare_ms, compile_ms, sample) = match self {
            Self::Whole(solve, None) => (solve.prepare_ms, solve.compile_ms, solve.sample(round, meter)?),
            Self::Whole(solve, Some(pool)) => {
                (solve.prepare_ms, solve.compile_ms, pool.install(|| solve.sample(round, meter))?)
            }
            Self::Parts(parts) => (parts.prepare_ms, None, parts.sample(round, meter)?),
        };
        Ok(Sample { prepare_ms: Some(prepare_ms), compile_ms, ..sample })
    }

    /// The labels of the last solve.
    pub fn labels(&self) -> &[u16] {
        match self {
            Self::Whole(solve, _) => solve.driver.labels(),
            Self::Parts(parts) => parts.driver.labels(),
        }
    }

    /// The most bytes that were allocated at a time.
    pub fn allocated_bytes(&self) -> u64 {
        match self {
            Self::Whole(solve, _) => solve.driver.allocated_bytes(),
            Self::Parts(parts) => parts.driver.allocated_bytes(),
        }
    }
}

impl<'a> Parts<'a> {
    fn prepare(
        runner: &'a Runner,
        plan: Plan,
        pair: &'a StereoPair,
        parting: Parting,
    ) -> Result<Arranged<'a>, Failure> {
        runner.on_device(|device| {
            let needed = PartDriver::planned_bytes(device, &plan, parting)?;
            machine::check_memory(runner.info.kind, needed, "--quick needs less")?;
            let start = Instant::now();
            let driver = PartDriver::new(device, plan, parting)?;
            let prepare_ms = milliseconds(start.elapsed());
            Ok(Arranged::Parts(Box::new(Self { runner, pair, driver, prepare_ms })))
        })
    }

    fn sample(&mut self, round: u32, meter: &Meter<'_>) -> Result<Sample, Failure> {
        let Self { runner, pair, driver, .. } = self;
        let is_stopped = || meter.observe(0).is_break();
        let times = runner.on_device(|device| Ok(driver.solve(device, pair, &is_stopped)?))?;
        Ok(Sample::new(round, &times))
    }
}
