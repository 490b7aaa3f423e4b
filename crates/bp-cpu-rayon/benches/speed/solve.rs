//! Contestants that match a pair.

use std::{collections::BTreeMap, time::Duration};

use bp_core::{
    Algorithm, Backend, Driver, Energy, Error, Model, Plan, Profile, Schedule, Settings, Size, Stage, StereoPair, Times,
};
use bp_cpu_rayon::Rayon;
use rayon::ThreadPool;

use crate::{
    Failure,
    pairs::Scene,
    turns::{Contestant, Sample},
};

/// What is solved.
pub(crate) struct Case<'a> {
    /// The pair.
    pub(crate) scene: &'a Scene,
    /// Its profile.
    pub(crate) profile: Profile,
    /// Number of labels.
    pub(crate) labels: usize,
    /// What is run.
    pub(crate) settings: Settings,
}

impl Case<'_> {
    /// The plan.
    pub(crate) fn plan(&self) -> Result<Plan, Error> {
        Plan::new(self.scene.pair.size(), Model::new(self.profile, self.labels)?, self.settings)
    }
}

/// Half-steps on each of so many grids, in checkerboard order.
pub(crate) fn hierarchy(size: Size, grids: u32, steps: u32) -> Settings {
    Settings { grids, steps, ..Algorithm::Cfbp.settings(size, 1, 1, Schedule::Checkerboard) }
}

/// The settings of [`Algorithm::Sweep`].
pub(crate) fn sweep(size: Size) -> Settings {
    Algorithm::Sweep.settings(size, 1, 1, Schedule::Sweep)
}

/// A case made ready.
pub(crate) struct Prepared<'a> {
    pool: &'a ThreadPool,
    pair: &'a StereoPair,
    /// Its last answer.
    pub(crate) driver: Driver,
}

impl<'a> Prepared<'a> {
    /// Prepares a case on a device of a backend and solves it once, unmeasured.
    pub(crate) fn new(
        pool: &'a ThreadPool,
        (backend, device): (&dyn Backend, usize),
        case: &Case<'a>,
    ) -> Result<Self, Failure> {
        let plan = case.plan()?;
        let driver = pool.install(|| Driver::new(backend.open(device)?.as_ref(), plan))?;
        let mut prepared = Self { pool, pair: &case.scene.pair, driver };
        prepared.solve()?;
        Ok(prepared)
    }

    /// Solves it in its pool.
    pub(crate) fn solve(&mut self) -> Result<Times, Error> {
        self.pool.install(|| self.driver.solve(self.pair))
    }
}

/// What is measured of a solve.
#[derive(Clone, Copy)]
pub(crate) enum Of {
    /// From the images to the labels, in milliseconds.
    Total,
    /// The stage of message updates, in nanoseconds a message entry.
    Updates,
}

impl Of {
    fn unit(self) -> &'static str {
        match self {
            Self::Total => "ms",
            Self::Updates => "ns per message entry",
        }
    }

    fn value(self, times: &Times, plan: &Plan) -> f64 {
        match self {
            Self::Total => milliseconds(times.total),
            Self::Updates => ns_per_entry(times, plan),
        }
    }
}

/// The time of the message updates divided by their number.
pub(crate) fn ns_per_entry(times: &Times, plan: &Plan) -> f64 {
    times.wall[Stage::UpdateMessages as usize].as_secs_f64() * 1e9 / plan.message_updates() as f64
}

/// In milliseconds.
pub(crate) fn milliseconds(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}

/// A contestant that solves a prepared case again and again.
pub(crate) fn contestant<'a>(
    name: String,
    of: Of,
    rounds: usize,
    asked: [Option<f64>; 2],
    mut prepared: Prepared<'a>,
) -> Contestant<'a> {
    let facts = BTreeMap::from([("MiB", (prepared.driver.allocated_bytes() as f64 / f64::from(1 << 20)).round())]);
    let run = Box::new(move || {
        let times = prepared.solve()?;
        let stages_ms = Some(times.wall.map(milliseconds));
        Ok(Sample { value: of.value(&times, prepared.driver.plan()), stages_ms })
    });
    Contestant { name, unit: of.unit(), rounds, asked, facts, run }
}

/// What is known of a scene's answer: its energy and, where the truth is known, the percentages of wrong pixels.
pub(crate) fn facts_of_answer(scene: &Scene, driver: &Driver) -> Result<BTreeMap<&'static str, f64>, Error> {
    let energy = Energy::of(&scene.pair, driver.plan().model(), driver.labels())?.total();
    let mut facts = BTreeMap::from([("energy", energy as f64)]);
    if let Some(truth) = &scene.truth {
        let errors = truth.errors(&driver.disparities())?;
        facts.insert("wrong, all (%)", errors.all.bad_or_unanswered[1]);
        facts.extend(errors.visible.map(|visible| ("wrong, visible (%)", visible.bad_or_unanswered[1])));
    }
    Ok(facts)
}

/// The instruction sets of this processor, the widest first: the devices of the rayon backend.
pub(crate) fn instruction_sets() -> Vec<String> {
    let name = |name: String| name.split(", ").nth(1).map_or(name.clone(), str::to_owned);
    Rayon.devices().into_iter().map(|device| name(device.name)).collect()
}

/// "1 thread" or "2 threads".
pub(crate) fn threads(count: usize) -> String {
    if count == 1 { "1 thread".to_owned() } else { format!("{count} threads") }
}
