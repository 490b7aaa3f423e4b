//! Takes the samples: every entrant in turns, so that whatever else the machine does meets all of them alike.

use std::collections::BTreeMap;

use bp_core::{Driver, Energy, Stage};

use super::{
    guarded::{Entrant, Guarded},
    runners::{Runner, Runners},
    verdict::Ratio,
};
use crate::{
    failure::Failure,
    interrupt::{self, ProgressBar},
    machine,
    report::format::Spread,
    reproduce::plans::{self, Planned},
    scenes::Scene,
    speed::milliseconds,
};

/// The most solves of a turn.
const MOST_SOLVES: u32 = 400;

/// What is solved.
pub(super) struct Problem {
    pub(super) scene: Scene,
    pub(super) labels: usize,
    /// Loops of plain BP.
    pub(super) k: u32,
}

/// Times of a solve, in milliseconds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    /// By the wall clock.
    pub(super) total_ms: f64,
    /// By the device's clock where it has one, in the order of [`Stage::ALL`].
    pub(super) stages_ms: [f64; Stage::ALL.len()],
}

/// What was measured.
pub(super) struct Measured {
    /// Every guarded speed-up, in order, but those that could not be had.
    pub(super) ratios: Vec<(Guarded, Ratio)>,
    /// What does not vary, by name.
    pub(super) facts: BTreeMap<String, Fact>,
}

/// Something that does not vary.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Fact {
    pub(super) value: String,
    /// Whose it is; none where it must be the same on every machine.
    pub(super) runner: Option<String>,
}

/// An entrant ready to run.
struct Ready<'a> {
    entrant: &'a Entrant,
    runner: &'a Runner,
    driver: Driver,
    solves: u32,
    /// One a round.
    turns: Vec<Sample>,
}

/// Measures everything that is guarded in so many rounds.
pub(super) fn measure(
    guarded: &[Guarded],
    runners: &Runners,
    problem: &Problem,
    rounds: u32,
) -> Result<Measured, Failure> {
    let entrants = entrants(guarded, &runners.lineup.reference);
    let bar = ProgressBar::new(entrants.len() as u64 * u64::from(rounds + 1));
    let mut facts = BTreeMap::new();
    let mut ready = Vec::new();
    for entrant in entrants {
        bar.message(format!("{} {}", entrant.runner, entrant.plan));
        ready.push(enter(entrant, runners, problem, &mut facts)?);
        let _ = bar.update(ready.len() as u64);
    }
    add_other_plans(runners, problem, &mut facts)?;
    let mut done = ready.len() as u64;
    for round in 1..=rounds {
        bar.message(format!("round {round} of {rounds}"));
        for entrant in &mut ready {
            entrant.take_turn(problem)?;
            done += 1;
            let _ = bar.update(done);
        }
    }
    bar.finish();
    let ratios = guarded.iter().filter_map(|guarded| Some((guarded.clone(), ratio(guarded, &ready)?))).collect();
    Ok(Measured { ratios, facts })
}

/// Everyone who is guarded, once; the reference first, since all others must answer as it did.
fn entrants<'a>(guarded: &'a [Guarded], reference: &str) -> Vec<&'a Entrant> {
    let mut entrants: Vec<&Entrant> = Vec::new();
    for entrant in guarded.iter().flat_map(|guarded| [&guarded.over, &guarded.of]) {
        if !entrants.contains(&entrant) {
            entrants.push(entrant);
        }
    }
    entrants.sort_by_key(|entrant| entrant.runner != reference);
    entrants
}

/// Makes an entrant ready, solves the problem once and adds what does not vary.
fn enter<'a>(
    entrant: &'a Entrant,
    runners: &'a Runners,
    problem: &Problem,
    facts: &mut BTreeMap<String, Fact>,
) -> Result<Ready<'a>, Failure> {
    interrupt::check()?;
    let planned = plans::all().into_iter().find(|planned| planned.name == entrant.plan);
    let known = runners.get(&entrant.runner).zip(planned);
    let (runner, planned) = known.ok_or_else(|| Failure::other(format!("there is no plan {}", entrant.plan)))?;
    let mut ready =
        Ready { entrant, runner, driver: prepare(runner, &planned, problem)?, solves: 1, turns: Vec::new() };
    let first = ready.solve(problem)?;
    ready.solves = ((runner.turn_ms / first.total_ms).ceil() as u32).clamp(1, MOST_SOLVES);
    add_answer(&runner.name, entrant.plan, &ready.driver, problem, facts)?;
    let owner = Some(runner.name.clone()).filter(|runner| *runner != runners.lineup.reference);
    let allocated = Fact { value: ready.driver.allocated_bytes().to_string(), runner: owner };
    facts.insert(format!("{}: {}, bytes allocated", runner.name, entrant.plan), allocated);
    Ok(ready)
}

/// Adds what the plans answer whose times are not guarded, by the fast processor backend.
fn add_other_plans(runners: &Runners, problem: &Problem, facts: &mut BTreeMap<String, Fact>) -> Result<(), Failure> {
    let Some(runner) = runners.get(&runners.lineup.one_thread) else { return Ok(()) };
    for planned in plans::all() {
        if facts.contains_key(&format!("{}: energy", planned.name)) {
            continue;
        }
        let mut driver = prepare(runner, &planned, problem)?;
        runner.run(|| driver.solve(&problem.scene.pair)).map_err(|error| Failure::from(error).of(&runner.name))?;
        add_answer(&runner.name, planned.name, &driver, problem, facts)?;
    }
    Ok(())
}

/// Adds what a plan answers; fails where another runner answered otherwise.
fn add_answer(
    runner: &str,
    plan: &str,
    driver: &Driver,
    problem: &Problem,
    facts: &mut BTreeMap<String, Fact>,
) -> Result<(), Failure> {
    for (name, value) in answer(driver, problem)? {
        let new = Fact { value: value.clone(), runner: None };
        let known = facts.entry(format!("{plan}: {name}")).or_insert(new);
        if known.value != value {
            let what = format!("{name} is {value}, on the reference {}", known.value);
            return Err(Failure::gate(format!("{runner} answers {plan} otherwise: {what}")));
        }
    }
    Ok(())
}

fn prepare(runner: &Runner, planned: &Planned, problem: &Problem) -> Result<Driver, Failure> {
    let plan = planned.plan(problem.scene.pair.size(), problem.labels, problem.k)?;
    let device = runner.opened.device.as_ref();
    let prepared = runner.run(|| {
        let needed = device.planned_bytes(&plan);
        machine::check_memory(runner.opened.info.kind, needed, "a full run needs more than --quick")?;
        Ok(Driver::new(device, plan)?)
    });
    prepared.map_err(|failure: Failure| failure.of(&runner.name))
}

/// What every backend must answer, by name.
fn answer(driver: &Driver, problem: &Problem) -> Result<[(&'static str, String); 5], Failure> {
    let (scene, plan) = (&problem.scene, driver.plan());
    let errors = scene.truth.errors(&driver.disparities())?;
    let visible = errors.visible.ok_or_else(|| Failure::other("a scene without visible pixels"))?;
    let energy = Energy::of(&scene.pair, plan.model(), driver.labels())?.total();
    Ok([
        ("message entries", plan.message_updates().to_string()),
        ("energy", energy.to_string()),
        ("wrong by > 1 px, visible, %", format!("{:.4}", visible.bad_or_unanswered[1])),
        ("wrong by > 1 px, all, %", format!("{:.4}", errors.all.bad_or_unanswered[1])),
        ("RMSE, px", format!("{:.4}", errors.all.rmse)),
    ])
}

impl Ready<'_> {
    fn solve(&mut self, problem: &Problem) -> Result<Sample, Failure> {
        let Self { runner, driver, .. } = self;
        let times =
            runner.run(|| driver.solve(&problem.scene.pair)).map_err(|error| Failure::from(error).of(&runner.name))?;
        // Without a clock of its own a GPU's stages are those of handing over work: they are no numbers.
        let waits = runner.opened.info.api.is_none();
        let stages = times.device.or(waits.then_some(times.wall)).map(|stages| stages.map(milliseconds));
        Ok(Sample { total_ms: milliseconds(times.total), stages_ms: stages.unwrap_or([f64::NAN; Stage::ALL.len()]) })
    }

    /// Solves the problem as often as a turn takes.
    fn take_turn(&mut self, problem: &Problem) -> Result<(), Failure> {
        interrupt::check()?;
        let solves = (0..self.solves).map(|_| self.solve(problem)).collect::<Result<Vec<_>, _>>()?;
        self.turns.push(Sample::median(&solves));
        Ok(())
    }
}

impl Sample {
    /// The median of each time.
    fn median(samples: &[Self]) -> Self {
        let median =
            |ms: &dyn Fn(&Self) -> f64| Spread::of(samples.iter().map(ms)).map_or(f64::NAN, |spread| spread.median);
        let mut stages_ms = [0.0; Stage::ALL.len()];
        for (stage, ms) in stages_ms.iter_mut().enumerate() {
            *ms = median(&|sample| sample.stages_ms[stage]);
        }
        Self { total_ms: median(&|sample| sample.total_ms), stages_ms }
    }
}

/// A speed-up, from the two times of each round; `None` where one of its entrants did not run.
fn ratio(guarded: &Guarded, ready: &[Ready<'_>]) -> Option<Ratio> {
    let turns = |entrant: &Entrant| Some(&ready.iter().find(|ready| ready.entrant == entrant)?.turns);
    let ratios = turns(&guarded.over)?.iter().zip(turns(&guarded.of)?);
    Ratio::of(&ratios.map(|(over, of)| guarded.part.ms(over) / guarded.part.ms(of)).collect::<Vec<_>>())
}
