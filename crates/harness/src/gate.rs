//! `bp gate`: speed-ups measured in turns and in one process, held against committed baselines; and held against them
//! exactly, what does not vary. `instructions` counts instructions instead of taking times.

mod baseline;
mod callgrind;
mod file;
mod guarded;
mod instructions;
mod judge;
mod measure;
mod runners;
mod table;
#[cfg(test)]
mod tests;
mod verdict;

use std::collections::BTreeMap;

use crate::{args::GateArgs, failure::Failure, machine, record::Machine, report::format::Spread, scenes};
use baseline::{Baseline, Baselines, Expected};
pub(crate) use callgrind::Solve;
use guarded::Guarded;
pub(crate) use instructions::instructions;
pub(crate) use judge::Judgement;
use measure::{Measured, Problem, measure};
use runners::Runners;
pub(crate) use table::page;

/// What the sides of the scene are divided by, labels, and loops of BP.
const FULL: (usize, usize, u32) = (2, 56, 56);

/// The same for a quick run.
const QUICK: (usize, usize, u32) = (3, 40, 18);

/// Measurements that a baseline is the median of: each makes everything ready anew, and where memory happens to lie
/// is a part of the noise.
const MEASUREMENTS_OF_A_BASELINE: usize = 3;

/// Measures and judges; with `--update`, renews the baselines.
pub(crate) fn gate(args: &GateArgs) -> Result<Judgement, Failure> {
    let machine = machine::machine(None);
    let mut baselines = Baselines::read(&args.baselines, &machine)?;
    let runners = Runners::open()?;
    let gate = Gate { args, guarded: guarded::all(&runners.lineup), problem: problem(args.quick)?, runners, machine };
    let first = gate.measure()?;
    let mut judgement = Judgement::new(&gate, &baselines, &first)?;
    if args.update {
        let mut all = vec![first];
        for _ in 1..MEASUREMENTS_OF_A_BASELINE {
            all.push(gate.measure()?);
        }
        gate.renew(&mut baselines, &all)?;
        judgement.written =
            [baselines.path_here(), baselines.path_anywhere()].map(|path| path.display().to_string()).into();
    } else if judgement.is_any_worse() {
        judgement.repeat(&gate.measure()?);
    }
    Ok(judgement)
}

/// A synthetic scene: the same on every machine.
fn problem(quick: bool) -> Result<Problem, Failure> {
    let (divisor, labels, k) = if quick { QUICK } else { FULL };
    Ok(Problem { scene: scenes::made_up(0, divisor)?, labels, k })
}

/// What is measured, and where.
struct Gate<'a> {
    args: &'a GateArgs,
    guarded: Vec<Guarded>,
    problem: Problem,
    runners: Runners,
    machine: Machine,
}

impl Gate<'_> {
    fn measure(&self) -> Result<Measured, Failure> {
        measure(&self.guarded, &self.runners, &self.problem, self.args.rounds)
    }

    /// Which of a baseline's runs is like this one.
    fn setting(&self) -> &'static str {
        if self.args.quick { "quick" } else { "full" }
    }

    fn devices(&self) -> BTreeMap<String, String> {
        self.runners.all.iter().map(|runner| (runner.name.clone(), runner.device())).collect()
    }

    /// Puts what was measured into both baselines and writes them.
    fn renew(&self, baselines: &mut Baselines, measured: &[Measured]) -> Result<(), Failure> {
        let reference = &self.runners.lineup.reference;
        let everywhere = |guarded: &Guarded| [&guarded.of, &guarded.over].iter().all(|side| side.runner == *reference);
        // What a baseline of other devices expects says nothing of these.
        let here = baselines.here.take().filter(|here| here.devices == self.devices());
        let mut here = here.unwrap_or_else(|| Baseline::new(Some(&self.machine), self.devices()));
        let mut anywhere = baselines.anywhere.take().unwrap_or_else(|| Baseline::new(None, BTreeMap::new()));
        here.renew(self.setting(), expected(measured, |_| true, true));
        anywhere.renew(self.setting(), expected(measured, everywhere, false));
        baselines.here = Some(here);
        baselines.anywhere = Some(anywhere);
        baselines.write()
    }
}

/// The median of each guarded speed-up over some measurements, and the facts that belong to a runner or to none.
fn expected(measured: &[Measured], is_guarded: impl Fn(&Guarded) -> bool, of_runners: bool) -> Expected {
    let median = |name: &str| {
        let ratios =
            measured.iter().flat_map(|measured| &measured.ratios).filter(|(guarded, _)| guarded.name() == name);
        Spread::of(ratios.map(|(_, ratio)| ratio.median)).map(|spread| (1000.0 * spread.median).round() / 1000.0)
    };
    let guarded = measured.iter().flat_map(|measured| &measured.ratios).map(|(guarded, _)| guarded);
    let names = guarded.filter(|guarded| is_guarded(guarded)).map(Guarded::name);
    let facts =
        measured.iter().flat_map(|measured| &measured.facts).filter(|(_, fact)| fact.runner.is_some() == of_runners);
    Expected {
        speed_ups: names.filter_map(|name| Some((name.clone(), median(&name)?))).collect(),
        facts: facts.map(|(name, fact)| (name.clone(), fact.value.clone())).collect(),
    }
}
