//! Takes the samples of a problem: contestants in turns, so that whatever else the machine does meets them alike.

use std::{
    ops::ControlFlow,
    time::{Duration, Instant},
};

use bp_core::{Driver, Plan, StereoPair, Times};
use sha2::{Digest, Sha256};

use super::{
    Problem,
    record::{Contest, Entry, Measurement, Outcome, Sample},
};
use crate::{
    backends::Opened,
    failure::Failure,
    files::hex,
    interrupt::{self, ProgressBar},
    machine,
    record::{Derived, Settings, clocks},
};

/// A contestant whose first solve takes more milliseconds takes part in [`FEW_ROUNDS`]: others would take too long, and
/// short disturbances matter less to it.
const FEW_ROUNDS_ABOVE_MS: f64 = 5000.0;

/// The rounds of such a contestant, unless fewer are asked for.
const FEW_ROUNDS: u32 = 3;

/// How far the whole run has come, in message entries.
pub(super) struct Work {
    bar: ProgressBar,
    done: u64,
    total: u64,
}

impl Work {
    /// A run of so many entries.
    pub(super) fn new(total: u64) -> Self {
        Self { bar: ProgressBar::new(total), done: 0, total }
    }

    /// Shows that a solve has come so far; breaks where the user has asked to stop.
    fn update(&self, done: u64) -> ControlFlow<()> {
        self.bar.update(self.done + done)
    }

    /// Leaves out so many entries.
    fn skip(&mut self, entries: u64) {
        self.total -= entries;
        self.bar.set_total(self.total);
    }

    /// Removes the bar.
    pub(super) fn finish(&self) {
        self.bar.finish();
    }
}

/// In milliseconds.
pub(crate) fn milliseconds(time: Duration) -> f64 {
    1000.0 * time.as_secs_f64()
}

/// Runs a problem on all devices.
pub(super) fn contest(
    (problem, plan): (Problem, Plan),
    pair: &StereoPair,
    devices: &mut [&mut Opened],
    rounds: u32,
    work: &mut Work,
) -> Result<Contest, Failure> {
    let settings = Settings::new(&plan, None, problem.algorithm(), Derived::default());
    let mut turns = Turns { name: problem.name(), plan, pair, rounds, work, answer: None };
    let mut entrants = Vec::new();
    for opened in devices.iter_mut() {
        let entered = turns.enter(opened);
        entrants.push(entered.or_else(|failure| turns.give_up(opened, failure, 1 + rounds).map(Entrant::Out))?);
    }
    for round in 0..rounds {
        for (opened, entrant) in devices.iter_mut().zip(&mut entrants) {
            turns.take(opened, entrant, round)?;
        }
    }
    let labels_sha256 = turns.answer.map(|(labels, _)| sha256(&labels));
    let entry = |(opened, entrant): (&&mut Opened, Entrant)| Entry {
        contestant: opened.name.clone(),
        outcome: match entrant {
            Entrant::In(_, measurement) => Outcome::Measured(measurement),
            Entrant::Out(outcome) => outcome,
        },
    };
    let (width, height) = (pair.size().width, pair.size().height);
    let entries = devices.iter().zip(entrants).map(entry).collect();
    let (problem, family) = (problem.name().to_owned(), problem.family());
    Ok(Contest { problem, family, width, height, settings, labels_sha256, entries })
}

fn sha256(labels: &[u16]) -> String {
    let bytes: Vec<u8> = labels.iter().flat_map(|label| label.to_le_bytes()).collect();
    hex(&Sha256::digest(bytes))
}

/// A device in a contest.
enum Entrant {
    /// It is ready for the next round.
    In(Box<Driver>, Box<Measurement>),
    /// It cannot go on.
    Out(Outcome),
}

/// Taking turns at a problem.
struct Turns<'a> {
    name: &'static str,
    plan: Plan,
    pair: &'a StereoPair,
    rounds: u32,
    work: &'a mut Work,
    /// The first answer, and whose it is: all others must be equal.
    answer: Option<(Vec<u16>, String)>,
}

impl Turns<'_> {
    /// Makes a device ready and has it solve the problem once, which warms it up and tells how long it takes.
    fn enter(&mut self, opened: &mut Opened) -> Result<Entrant, Failure> {
        interrupt::check()?;
        self.work.bar.message(format!("{} {}", self.name, opened.name));
        opened.recover()?;
        let planned = opened.device.planned_bytes(&self.plan);
        machine::check_memory(opened.info.kind, planned, "--quick needs less")?;
        let start = Instant::now();
        let mut driver = Driver::new(opened.device.as_ref(), self.plan.clone())?;
        let prepare_ms = milliseconds(start.elapsed());
        let first_ms = milliseconds(self.solve(opened, &mut driver)?.total);
        let rounds = if first_ms > FEW_ROUNDS_ABOVE_MS { self.rounds.min(FEW_ROUNDS) } else { self.rounds };
        self.work.skip(u64::from(self.rounds - rounds) * self.plan.message_updates());
        let line = format!("{:<12}{:<10}ready in {prepare_ms:>8.1} ms", self.name, opened.name);
        self.work.bar.line(&format!("{line}, first solve {first_ms:>10.1} ms"));
        let measurement = Measurement {
            prepare_ms,
            compile_ms: driver.compile_time().map(milliseconds),
            allocated_bytes: driver.allocated_bytes(),
            moved_bytes: driver.moved_bytes().map(Into::into),
            first_ms,
            rounds,
            samples: Vec::new(),
        };
        Ok(Entrant::In(Box::new(driver), Box::new(measurement)))
    }

    /// Takes the sample of a round, where the device takes part in it.
    fn take(&mut self, opened: &mut Opened, entrant: &mut Entrant, round: u32) -> Result<(), Failure> {
        let Entrant::In(driver, measurement) = entrant else { return Ok(()) };
        if round >= measurement.rounds {
            return Ok(());
        }
        self.work.bar.message(format!("{} {}, round {} of {}", self.name, opened.name, round + 1, measurement.rounds));
        match self.solve(opened, driver) {
            Ok(times) => {
                let total_ms = milliseconds(times.total);
                measurement.samples.push(Sample { round, total_ms, clocks: clocks(&times) });
            }
            Err(failure) => {
                let left = measurement.rounds - round;
                *entrant = Entrant::Out(self.give_up(opened, failure, left)?);
            }
        }
        Ok(())
    }

    /// Solves the problem; fails where the answer is not that of those before.
    fn solve(&mut self, opened: &Opened, driver: &mut Driver) -> Result<Times, Failure> {
        let work = &*self.work;
        let times = driver.solve_observed(self.pair, &mut |progress| work.update(progress.done))?;
        let (labels, whose) = self.answer.get_or_insert_with(|| (driver.labels().to_vec(), opened.name.clone()));
        if labels != driver.labels() {
            return Err(Failure::other(format!("other labels than {whose} gave")));
        }
        self.work.done += self.plan.message_updates();
        Ok(times)
    }

    /// What becomes of a device that failed with so many solves to go; stopping the program stops all of them.
    fn give_up(&mut self, opened: &mut Opened, failure: Failure, left: u32) -> Result<Outcome, Failure> {
        if failure.is_interrupted() {
            return Err(failure);
        }
        opened.note(failure.cause());
        self.work.skip(u64::from(left) * self.plan.message_updates());
        self.work.bar.line(&format!("{:<12}{:<10}{failure}", self.name, opened.name));
        let beyond = failure.is_beyond_device();
        Ok(if beyond { Outcome::Unavailable(failure.to_string()) } else { Outcome::Error(failure.to_string()) })
    }
}
