//! Takes the samples of everything that is guarded, and collects the results that do not vary.

use std::{cell::RefCell, collections::BTreeMap};

use bp_core::{Driver, Energy};

use super::{
    conditions::{Conditions, Observer},
    guarded::{Entrant, Guarded, Part},
    runners::Runners,
    verdict::Ratio,
};
use bp_stereo::Watch;

use crate::{
    failure::Failure,
    measure::{self, Contestant, Meter, Rules, Runner, Solve, take_turns},
    record::Sample,
    reproduce::plans::{self, Planned},
    scenes::Scene,
};

/// A turn repeats a solve for about this many milliseconds. The time of a single short solve would mostly reflect what
/// ran before it.
const TURN_MS: f64 = 20.0;

/// The same for all threads of the fast CPU backend. The system needs a while to spread threads that just woke up over
/// the cores; until then two threads are no faster than one.
const TURN_OF_THREADS_MS: f64 = 300.0;

/// Maximum number of solves per turn.
const MOST_SOLVES: u32 = 400;

/// The problem to solve.
pub(super) struct Problem {
    pub(super) scene: Scene,
    pub(super) labels: usize,
    /// Iterations of plain BP.
    pub(super) k: u32,
}

/// What was measured.
pub(super) struct Measured {
    /// Every guarded speed-up that could be measured, in order.
    pub(super) ratios: Vec<(Guarded, Ratio)>,
    /// Results that do not vary, by name.
    pub(super) facts: Facts,
    /// What the machine was like meanwhile.
    pub(super) conditions: Conditions,
}

/// A result that does not vary.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Fact {
    pub(super) value: String,
    /// The runner it belongs to; `None` if it must be the same on every machine.
    pub(super) runner: Option<String>,
}

/// Facts by name.
pub(super) type Facts = BTreeMap<String, Fact>;

/// Measures everything that is guarded.
pub(super) fn measure(
    guarded: &[Guarded],
    runners: &Runners,
    problem: &Problem,
    rounds: u32,
    watch: &Watch<'_>,
) -> Result<Measured, Failure> {
    let facts = RefCell::default();
    let enter = |entrant| {
        let turn = Turn::new(entrant, runners, problem, &facts)?;
        Ok(measure::Entrant::new(format!("{} {}", entrant.runner, entrant.plan), turn))
    };
    let entrants = entrants(guarded, &runners.lineup.reference).into_iter();
    let mut entrants = entrants.map(enter).collect::<Result<Vec<_>, Failure>>()?;
    let rules = Rules { rounds, slow_rounds: rounds, warm_up: true, fail_fast: true };
    let observer = Observer::begin();
    take_turns(&mut entrants, &rules, &mut Meter::new(watch))?;
    let conditions = observer.end();
    let ratios = guarded.iter().filter_map(|guarded| Some((guarded.clone(), ratio(guarded, &entrants)?))).collect();
    drop(entrants);
    let mut facts = facts.into_inner();
    add_other_plans(runners, problem, &mut facts, watch)?;
    Ok(Measured { ratios, facts, conditions })
}

/// All guarded entrants, without duplicates. The reference comes first, because all others must give its answers.
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

/// A plan on a runner, which takes turns.
struct Turn<'a> {
    entrant: &'a Entrant,
    runner: &'a Runner,
    planned: Planned,
    problem: &'a Problem,
    facts: &'a RefCell<Facts>,
    /// The runner whose memory use is the same on every machine.
    reference: &'a str,
    /// Minimum duration of a turn, unless that needs too many solves.
    turn_ms: f64,
    solves: u32,
    ready: Option<Solve<'a>>,
}

impl<'a> Turn<'a> {
    fn new(
        entrant: &'a Entrant,
        runners: &'a Runners,
        problem: &'a Problem,
        facts: &'a RefCell<Facts>,
    ) -> Result<Self, Failure> {
        let planned = plans::all().into_iter().find(|planned| planned.name == entrant.plan);
        let known = runners.get(&entrant.runner).zip(planned);
        let (runner, planned) = known.ok_or_else(|| Failure::other(format!("there is no plan {}", entrant.plan)))?;
        let threaded = runners.lineup.all_threads.as_ref() == Some(&runner.name);
        let turn_ms = if threaded { TURN_OF_THREADS_MS } else { TURN_MS };
        let reference = &runners.lineup.reference;
        Ok(Self { entrant, runner, planned, problem, facts, reference, turn_ms, solves: 1, ready: None })
    }

    /// Adds the plan's results and the bytes that it allocates.
    fn add_facts(&self, driver: &Driver) -> Result<(), Failure> {
        let (runner, facts) = (&self.runner.name, &mut self.facts.borrow_mut());
        add_answer(runner, self.entrant.plan, driver, self.problem, facts)?;
        let owner = Some(runner.clone()).filter(|runner| runner != self.reference);
        let allocated = Fact { value: driver.allocated_bytes().to_string(), runner: owner };
        facts.insert(format!("{runner}: {}, bytes allocated", self.entrant.plan), allocated);
        Ok(())
    }
}

impl Contestant for Turn<'_> {
    fn warm_up(&mut self, meter: &Meter<'_>) -> Result<Sample, Failure> {
        let mut solve = prepare(self.runner, &self.planned, self.problem)?;
        let first = solve.sample(0, meter).map_err(|failure| failure.of(&self.runner.name))?;
        self.solves = ((self.turn_ms / first.total_ms).ceil() as u32).clamp(1, MOST_SOLVES);
        self.add_facts(&solve.driver)?;
        self.ready = Some(solve);
        Ok(first)
    }

    /// Repeats the solve as often as a turn needs; returns the medians. Reports nothing meanwhile, because reporting
    /// would add to the times of short solves.
    fn turn(&mut self, round: u32, _: &Meter<'_>) -> Result<Sample, Failure> {
        let not_ready = || Failure::other("it is not ready");
        let solve = self.ready.as_mut().ok_or_else(not_ready)?;
        let silent = Meter::new(&Watch::default());
        let samples = (0..self.solves).map(|_| solve.sample(round, &silent)).collect::<Result<Vec<_>, _>>();
        let samples = samples.map_err(|failure| failure.of(&self.runner.name))?;
        Sample::median(&samples).ok_or_else(not_ready)
    }

    fn entries(&self) -> u64 {
        u64::from(self.solves) * self.ready.as_ref().map_or(1, Solve::entries)
    }
}

/// Adds the results of the plans whose times are not guarded, solved by the fast CPU backend.
fn add_other_plans(runners: &Runners, problem: &Problem, facts: &mut Facts, watch: &Watch<'_>) -> Result<(), Failure> {
    let Some(runner) = runners.get(&runners.lineup.one_thread) else { return Ok(()) };
    for planned in plans::all() {
        if facts.contains_key(&format!("{}: energy", planned.name)) {
            continue;
        }
        let mut solve = prepare(runner, &planned, problem)?;
        solve.sample(0, &Meter::new(watch)).map_err(|failure| failure.of(&runner.name))?;
        add_answer(&runner.name, planned.name, &solve.driver, problem, facts)?;
    }
    Ok(())
}

/// Adds a plan's results; fails if another runner gave different ones.
fn add_answer(runner: &str, plan: &str, driver: &Driver, problem: &Problem, facts: &mut Facts) -> Result<(), Failure> {
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

fn prepare<'a>(runner: &'a Runner, planned: &Planned, problem: &'a Problem) -> Result<Solve<'a>, Failure> {
    let plan = planned.plan(problem.scene.pair.size(), problem.labels, problem.k)?;
    Solve::prepare(runner, plan, &problem.scene.pair).map_err(|failure| failure.of(&runner.name))
}

/// The results that all backends must agree on, by name.
fn answer(driver: &Driver, problem: &Problem) -> Result<[(&'static str, String); 5], Failure> {
    let (scene, plan) = (&problem.scene, driver.plan());
    let errors = scene.truth.errors(&driver.disparities()?)?;
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

/// A speed-up, from the two times of each round. `None` if one of its entrants did not run, or if a device without a
/// clock of its own cannot time a stage.
fn ratio(guarded: &Guarded, entrants: &[measure::Entrant<Turn<'_>>]) -> Option<Ratio> {
    let samples = |entrant: &Entrant| {
        let own = entrants.iter().find(|own| own.contestant.entrant == entrant)?;
        let timed = |sample: &Sample| own.contestant.runner.waits() || sample.device_ms().is_some();
        (guarded.part == Part::Total || own.samples.iter().all(timed)).then_some(&own.samples)
    };
    let (over, of) = (samples(&guarded.over)?, samples(&guarded.of)?);
    Ratio::of(&Sample::ratios(over, of, |sample| guarded.part.ms(sample)))
}
