//! A plan on a runner, prepared and timed.

use std::time::{Duration, Instant};

use bp_core::{DeviceKind, Driver, Plan, StereoPair};
use bp_stereo::Watch;

use super::{Meter, Runner};
use crate::{
    failure::Failure,
    machine,
    record::{Sample, milliseconds},
};

/// How long threads that just woke up may run on one core, before the system spreads them over all.
const SETTLING: Duration = Duration::from_millis(60);

/// A prepared plan, the device that solves it, and the pair that it is solved for.
pub struct Solve<'a> {
    runner: &'a Runner,
    pair: &'a StereoPair,
    /// The prepared plan.
    pub driver: Driver,
    /// How long it took to allocate everything.
    pub prepare_ms: f64,
    /// How much of that was compiling kernels, if the device compiles any.
    pub compile_ms: Option<f64>,
}

impl<'a> Solve<'a> {
    /// Prepares a plan. A lost device is reopened first.
    pub fn prepare(runner: &'a Runner, plan: Plan, pair: &'a StereoPair) -> Result<Self, Failure> {
        runner.on_device(|device| {
            machine::check_memory(runner.info.kind, device.planned_bytes(&plan), "--quick needs less")?;
            let start = Instant::now();
            let driver = Driver::new(device, plan)?;
            let prepare_ms = milliseconds(start.elapsed());
            let compile_ms = driver.compile_time().map(milliseconds);
            Ok(Self { runner, pair, driver, prepare_ms, compile_ms })
        })
    }

    /// Solves it once.
    pub fn sample(&mut self, round: u32, meter: &Meter<'_>) -> Result<Sample, Failure> {
        let Self { runner, pair, driver, .. } = self;
        let times = runner.run(|| Ok(driver.solve_observed(pair, &mut |progress| meter.observe(progress.done))?))?;
        Ok(Sample::new(round, &times))
    }

    /// Solves it without counting until the threads of this machine's processor have settled. Other devices have none, and a solve
    /// that takes much longer hardly notices.
    pub fn settle(&mut self, usual_ms: f64) -> Result<(), Failure> {
        let silent = Meter::new(&Watch::default());
        let start = Instant::now();
        while self.runner.info.kind == DeviceKind::Processor && usual_ms < 1000.0 && start.elapsed() < SETTLING {
            self.sample(0, &silent)?;
        }
        Ok(())
    }

    /// Message entries of a solve.
    pub fn entries(&self) -> u64 {
        self.driver.plan().message_updates()
    }
}
