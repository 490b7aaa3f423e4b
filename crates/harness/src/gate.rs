//! `bp gate`: compares speed-ups, measured in turns within one process, with committed baselines. Results that do not
//! vary must equal their baselines exactly. `instructions` counts instructions instead of measuring time.

mod baseline;
mod callgrind;
mod conditions;
mod file;
mod guarded;
mod instructions;
mod judge;
mod measure;
mod renew;
mod runners;
mod subject;
mod table;
#[cfg(test)]
mod tests;
mod verdict;

use bp_stereo::Watch;

use crate::{failure::Failure, machine, scenes};
use baseline::Baselines;
pub use callgrind::Counted;
pub use instructions::instructions;
pub use judge::Judgement;
use measure::Problem;
use runners::Runners;
use subject::Gate;
pub use subject::{GateOptions, Renewal};
pub use table::page;

/// Whether the text of a file is a baseline, of speed-ups or of instruction counts.
#[cfg(feature = "fuzzing")]
pub fn is_baseline(path: &std::path::Path, text: &str) -> bool {
    file::parse::<baseline::Baseline>(path, text).is_ok() || file::parse::<callgrind::Counts>(path, text).is_ok()
}

/// Divisor of the scene's width and height, number of labels, and iterations of BP.
const FULL: (usize, usize, u32) = (2, 56, 56);

/// The same for a quick run.
const QUICK: (usize, usize, u32) = (3, 40, 18);

/// A baseline is the median of this many measurements. Each sets up everything again, because memory placement is part
/// of the noise.
const MEASUREMENTS_OF_A_BASELINE: usize = 3;

/// Measures and judges. Renews the baselines if asked.
pub fn gate(options: &GateOptions, watch: &Watch<'_>) -> Result<Judgement, Failure> {
    let machine = machine::machine(None);
    let mut baselines = Baselines::read(&options.baselines, &machine, options.update.is_some())?;
    let runners = Runners::open()?;
    let gate =
        Gate { options, guarded: guarded::all(&runners.lineup), problem: problem(options.quick)?, runners, machine };
    let first = gate.measure(watch)?;
    let mut judgement = Judgement::new(&gate, &baselines, &first)?;
    if let Some(renewal) = options.update {
        let mut all = vec![first];
        for _ in 1..MEASUREMENTS_OF_A_BASELINE {
            all.push(gate.measure(watch)?);
        }
        judgement.written = gate.renew(renewal, &mut baselines, &all)?;
        return Ok(judgement);
    }
    if judgement.is_any_worse() {
        judgement.repeat(&gate.measure(watch)?);
    }
    if let Some(folder) = options.proposal.as_ref().filter(|_| judgement.calls_for_a_baseline()) {
        judgement.written = gate.renew(Renewal::Here, &mut baselines.moved_to(folder), &[first])?;
    }
    Ok(judgement)
}

/// A synthetic scene, which is the same on every machine.
fn problem(quick: bool) -> Result<Problem, Failure> {
    let (divisor, labels, k) = if quick { QUICK } else { FULL };
    Ok(Problem { scene: scenes::made_up(0, divisor)?, labels, k })
}
