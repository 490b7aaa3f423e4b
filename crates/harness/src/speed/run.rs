//! Takes the samples of `bp speed`, one problem after another.

use std::{cell::RefCell, path::PathBuf};

use bp_core::{Plan, StereoPair};
use bp_stereo::Watch;
use bp_testkit::synthetic;
use jiff::Timestamp;
use sha2::{Digest, Sha256};

use super::problems::{self, Problem};
use crate::{
    failure::Failure,
    files::hex,
    machine,
    measure::{Asked, Contestant, Entrant, Meter, Rules, Runner, SLOW_ROUNDS, Solve, take_turns},
    record::{
        Outcome, Sample, Settings, milliseconds,
        speed::{self, Contest, Entry, Measurement, SCHEMA_VERSION, Speed},
    },
};

/// Default number of rounds of a full run.
const ROUNDS: u32 = 9;

/// A quick run divides the sides of images by this.
const QUICK_DIVISOR: usize = 3;

/// The options of a run.
#[derive(Debug, Default)]
pub struct SpeedOptions {
    /// The groups of problems, named as in [`Problem::ASKED`]. If empty, those that run by default.
    pub problems: Vec<String>,
    /// Rounds, by default nine, or one in a quick run.
    pub rounds: Option<u32>,
    /// Whether to use images of a third of the width and height.
    pub quick: bool,
    /// The folder of the record, the page and the charts.
    pub output: Option<PathBuf>,
}

/// Measures the selected problems on these devices, at least one of which is open.
pub fn measure(options: &SpeedOptions, asked: &[Asked], watch: &Watch<'_>) -> Result<Speed, Failure> {
    let mut speed = Speed {
        schema_version: SCHEMA_VERSION,
        started: Timestamp::now().to_string(),
        program: machine::program()?,
        machine: machine::machine(None),
        quick: options.quick,
        rounds: options.rounds.unwrap_or(if options.quick { 1 } else { ROUNDS }),
        threads: rayon::current_num_threads(),
        contestants: asked.iter().map(|asked| contestant(asked, watch)).collect::<Result<_, _>>()?,
        contests: Vec::new(),
    };
    let rules = Rules { rounds: speed.rounds, slow_rounds: SLOW_ROUNDS, warm_up: true, fail_fast: false };
    let divisor = if options.quick { QUICK_DIVISOR } else { 1 };
    let scene = synthetic::scene(0, divisor).pair;
    let problems = Problem::asked(&options.problems).into_iter();
    let plans = problems.map(|problem| Ok((problem.plan(divisor)?, problem))).collect::<Result<Vec<_>, Failure>>()?;
    let solves = Asked::opened(asked).count() as u64 * u64::from(1 + rules.rounds);
    let mut meter = Meter::new(watch);
    meter.ahead = plans.iter().map(|(plan, _)| solves * plan.message_updates()).sum();
    for (plan, problem) in plans {
        meter.ahead -= solves * plan.message_updates();
        let pair = problems::pair(&scene, plan.image_size())?;
        speed.contests.push(contest(&problem, &plan, &pair, asked, &rules, &mut meter)?);
    }
    Ok(speed)
}

/// Describes a contestant: its device, the time to open it, and its copy rate.
fn contestant(asked: &Asked, watch: &Watch<'_>) -> Result<speed::Contestant, Failure> {
    watch.check()?;
    let runner = asked.runner.as_ref();
    Ok(speed::Contestant {
        name: asked.name.clone(),
        device: runner.ok().map(|runner| (&runner.info).into()),
        unavailable: runner.err().cloned(),
        open_ms: runner.ok().map(|runner| milliseconds(runner.open_time)),
        copy_gb_per_s: runner.ok().and_then(|runner| copy_gb_per_s(runner, watch)),
    })
}

/// The copy rate of a device. A device that fails to measure it may still solve problems.
fn copy_gb_per_s(runner: &Runner, watch: &Watch<'_>) -> Option<f64> {
    let rate = runner.on_device(|device| Ok(device.copy_rate()?));
    let unknown = |failure: &Failure| watch.note(&format!("{}: its copy rate is not known: {failure}", runner.name));
    rate.inspect_err(unknown).ok().flatten().map(|rate| rate / 1e9)
}

/// Runs a problem on all devices.
fn contest(
    problem: &Problem,
    plan: &Plan,
    pair: &StereoPair,
    asked: &[Asked],
    rules: &Rules,
    meter: &mut Meter<'_>,
) -> Result<Contest, Failure> {
    let answer = RefCell::new(None);
    let entrant = |runner| {
        let contestant = OnDevice { problem, runner, plan, pair, answer: &answer, ready: None, first_ms: 0.0 };
        Entrant::new(contestant.name(), contestant)
    };
    let mut entrants: Vec<_> = Asked::opened(asked).map(entrant).collect();
    take_turns(&mut entrants, rules, meter)?;
    let entries = entrants.into_iter().map(|entrant| entry(entrant, rules)).collect();
    Ok(Contest {
        problem: problem.name.clone(),
        family: problem.family,
        width: pair.size().width,
        height: pair.size().height,
        settings: Settings::new(plan, None, problem.algorithm()),
        labels_sha256: answer.into_inner().map(|Answer { labels, .. }| sha256(&labels)),
        entries,
    })
}

fn sha256(labels: &[u16]) -> String {
    let bytes: Vec<u8> = labels.iter().flat_map(|label| label.to_le_bytes()).collect();
    hex(&Sha256::digest(bytes))
}

/// The first answer to a problem. All others must be equal.
struct Answer {
    labels: Vec<u16>,
    /// The name of the runner that gave it.
    whose: String,
}

/// A device that solves a problem. It prepares the plan once.
struct OnDevice<'a> {
    problem: &'a Problem,
    runner: &'a Runner,
    plan: &'a Plan,
    pair: &'a StereoPair,
    answer: &'a RefCell<Option<Answer>>,
    ready: Option<Solve<'a>>,
    /// How long the first solve took.
    first_ms: f64,
}

impl OnDevice<'_> {
    fn name(&self) -> String {
        format!("{:<12}{:<10}", self.problem.name, self.runner.name)
    }

    fn solve(&mut self, round: u32, meter: &Meter<'_>) -> Result<Sample, Failure> {
        let solve = self.ready.as_mut().ok_or_else(|| Failure::other("it is not ready"))?;
        let sample = solve.sample(round, meter)?;
        let (labels, mut answer) = (solve.driver.labels(), self.answer.borrow_mut());
        let first = || Answer { labels: labels.to_vec(), whose: self.runner.name.clone() };
        let Answer { labels: expected, whose } = answer.get_or_insert_with(first);
        if expected != labels {
            return Err(Failure::other(format!("other labels than {whose} gave")));
        }
        Ok(sample)
    }
}

impl Contestant for OnDevice<'_> {
    fn warm_up(&mut self, meter: &Meter<'_>) -> Result<Sample, Failure> {
        let solve = Solve::prepare(self.runner, self.plan.clone(), self.pair)?;
        let prepare_ms = solve.prepare_ms;
        self.ready = Some(solve);
        let first = self.solve(0, meter)?;
        self.first_ms = first.total_ms;
        let times = format!("ready in {prepare_ms:>8.1} ms, first solve {:>10.1} ms", first.total_ms);
        meter.line(&(self.name() + &times));
        Ok(first)
    }

    fn turn(&mut self, round: u32, meter: &Meter<'_>) -> Result<Sample, Failure> {
        if let Some(solve) = &mut self.ready {
            solve.settle(self.first_ms)?;
        }
        self.solve(round, meter)
    }

    fn keep(&mut self, taken: Result<&Sample, &Failure>) -> Result<(), Failure> {
        if taken.is_err() {
            self.ready = None;
        }
        Ok(())
    }

    fn entries(&self) -> u64 {
        self.plan.message_updates()
    }
}

/// The result of a contestant.
fn entry(entrant: Entrant<OnDevice<'_>>, rules: &Rules) -> Entry {
    let Entrant { contestant: OnDevice { runner, ready, .. }, first_ms, samples, failure, .. } = entrant;
    let outcome = match (failure, ready, first_ms) {
        (Some(failure), ..) => Outcome::failed(&failure),
        (None, Some(Solve { driver, prepare_ms, compile_ms, .. }), Some(first_ms)) => {
            Outcome::Measured(Box::new(Measurement {
                prepare_ms,
                compile_ms,
                allocated_bytes: driver.allocated_bytes(),
                moved_bytes: driver.moved_bytes().map(Into::into),
                first_ms,
                rounds: rules.rounds_for(first_ms),
                samples,
            }))
        }
        (None, ..) => Outcome::Pending,
    };
    Entry { contestant: runner.name.clone(), outcome }
}

/// Fails if a device failed, or if none could run anything.
pub fn check(speed: &Speed) -> Result<(), Failure> {
    let entries =
        || speed.contests.iter().flat_map(|contest| contest.entries.iter().map(move |entry| (contest, entry)));
    let mut failed = entries().filter_map(|(contest, entry)| match &entry.outcome {
        Outcome::Error(error) => Some(format!("{} on {}: {error}", contest.problem, entry.contestant)),
        Outcome::Pending | Outcome::Measured(_) | Outcome::Unavailable(_) => None,
    });
    if let Some(first) = failed.next() {
        return Err(Failure::other(format!("{} solves failed, such as {first}", 1 + failed.count())));
    }
    if entries().all(|(_, entry)| entry.outcome.measured().is_none()) {
        return Err(Failure::unavailable("no device could run any of the problems"));
    }
    Ok(())
}
