//! Compares measurements with baselines.

use serde::Serialize;

use super::{
    baseline::{Baseline, Baselines, Expected},
    guarded::Guarded,
    measure::{Fact, Measured},
    subject::Gate,
    verdict::{Ratio, Verdict},
};
use crate::{
    failure::Failure,
    machine,
    record::{Machine, Program},
};

/// Tolerated loss, a fraction, of speed-ups that only have a baseline for all machines. The work that a plan saves does
/// not depend on the machine, but the speed of the caches does.
const TOLERANCE_ANYWHERE: f64 = 0.4;

/// The result of a gate.
#[derive(Serialize)]
pub struct Judgement {
    pub(super) program: Program,
    pub(super) machine: Machine,
    pub(super) quick: bool,
    pub(super) rounds: u32,
    /// The baseline file for this kind of machine.
    pub(super) baseline: String,
    /// Whether that file has expectations for this run.
    pub(super) has_baseline: bool,
    /// Runners, each with its device.
    pub(super) devices: Vec<(String, String)>,
    /// Backends without a device, and why.
    pub(super) unavailable: Vec<String>,
    pub(super) speed_ups: Vec<SpeedUp>,
    pub(super) facts: Vec<JudgedFact>,
    /// Expected results of available devices that were not measured.
    pub(super) missing: Vec<String>,
    /// Baselines that were written.
    pub written: Vec<String>,
}

/// A guarded speed-up, judged.
#[derive(Serialize)]
pub(super) struct SpeedUp {
    pub(super) name: String,
    pub(super) first: Ratio,
    /// The second measurement, if the first was worse.
    pub(super) second: Option<Ratio>,
    pub(super) baseline: Option<f64>,
    /// The fraction of the baseline that may be lost.
    pub(super) tolerance: f64,
    pub(super) verdict: Verdict,
}

/// A result that does not vary, judged.
#[derive(Serialize)]
pub(super) struct JudgedFact {
    pub(super) name: String,
    pub(super) value: String,
    /// The expected value, if known.
    pub(super) baseline: Option<String>,
}

impl JudgedFact {
    pub(super) fn has_changed(&self) -> bool {
        self.baseline.as_ref().is_some_and(|baseline| *baseline != self.value)
    }
}

impl SpeedUp {
    fn is_worse(&self) -> bool {
        self.verdict == Verdict::Worse
    }
}

impl Judgement {
    /// Judges a first measurement.
    pub(super) fn new(gate: &Gate<'_>, baselines: &Baselines, measured: &Measured) -> Result<Self, Failure> {
        let devices = gate.runners.devices();
        let known = Known { gate, baselines };
        Ok(Self {
            program: machine::program()?,
            machine: gate.machine.clone(),
            quick: gate.options.quick,
            rounds: gate.options.rounds,
            baseline: baselines.path_here().display().to_string(),
            has_baseline: known.expected(baselines.here.as_ref()).is_some(),
            devices: devices.into_iter().collect(),
            unavailable: gate.runners.unavailable.clone(),
            speed_ups: measured.ratios.iter().map(|(guarded, ratio)| known.speed_up(guarded, *ratio)).collect(),
            facts: measured.facts.iter().map(|(name, fact)| known.fact(name, fact)).collect(),
            missing: known.missing(measured),
            written: Vec::new(),
        })
    }

    /// Whether a speed-up is worse than the tolerance.
    pub(super) fn is_any_worse(&self) -> bool {
        self.speed_ups.iter().any(SpeedUp::is_worse)
    }

    /// Judges again the speed-ups that were worse: they fail only if they are worse both times.
    pub(super) fn repeat(&mut self, measured: &Measured) {
        for speed_up in self.speed_ups.iter_mut().filter(|speed_up| speed_up.is_worse()) {
            let again = measured.ratios.iter().find(|(guarded, _)| guarded.name() == speed_up.name);
            speed_up.second = again.map(|&(_, ratio)| ratio);
            if let Some((second, baseline)) = speed_up.second.zip(speed_up.baseline) {
                speed_up.verdict = second.judge(baseline, speed_up.tolerance);
            }
        }
    }

    /// Describes the speed-ups that are worse, the results that changed, and the expected results that are missing.
    pub fn failures(&self) -> Vec<String> {
        let worse = self.speed_ups.iter().filter(|speed_up| speed_up.is_worse()).map(|speed_up| {
            let now = speed_up.second.unwrap_or(speed_up.first).median;
            format!("{}: {now:.2} times, was {:.2}", speed_up.name, speed_up.baseline.unwrap_or(f64::NAN))
        });
        let changed =
            self.facts.iter().filter(|fact| fact.has_changed()).map(|fact| {
                format!("{}: {}, was {}", fact.name, fact.value, fact.baseline.as_deref().unwrap_or_default())
            });
        let missing = self.missing.iter().map(|name| format!("{name}: in the baseline, but not measured any more"));
        worse.chain(changed).chain(missing).collect()
    }
}

/// What the baselines expect of a run.
struct Known<'a> {
    gate: &'a Gate<'a>,
    baselines: &'a Baselines,
}

impl<'a> Known<'a> {
    /// What a baseline expects of a run with these settings.
    fn expected(&self, baseline: Option<&'a Baseline>) -> Option<&'a Expected> {
        baseline?.runs.get(self.gate.setting())
    }

    /// What this machine's baseline expects, if these runners used the same devices when it was recorded.
    fn expected_here(&self, runners: &[&String]) -> Option<&'a Expected> {
        let (here, devices) = (self.expected(self.baselines.here.as_ref())?, self.gate.runners.devices());
        runners.iter().all(|&runner| here.devices.get(runner) == devices.get(runner)).then_some(here)
    }

    /// Expected results of available devices that were not measured.
    fn missing(&self, measured: &Measured) -> Vec<String> {
        let devices = self.gate.runners.devices();
        let of_device = |expected: &Expected, name: &str| {
            let is_of = |runner: &String| {
                name.starts_with(&format!("{runner}: ")) || name.starts_with(&format!("{runner} over "))
            };
            let same = |(runner, device)| !is_of(runner) || devices.get(runner) == Some(device);
            expected.devices.iter().all(same)
        };
        let is_measured = |name: &str| {
            measured.facts.contains_key(name) || measured.ratios.iter().any(|(guarded, _)| guarded.name() == name)
        };
        let all = [&self.baselines.here, &self.baselines.anywhere].map(|baseline| self.expected(baseline.as_ref()));
        let mut missing: Vec<_> = (all.into_iter().flatten())
            .flat_map(|expected| {
                let names = expected.speed_ups.keys().chain(expected.facts.keys());
                names.filter(|name| of_device(expected, name) && !is_measured(name)).cloned()
            })
            .collect();
        missing.dedup();
        missing
    }

    fn speed_up(&self, guarded: &Guarded, first: Ratio) -> SpeedUp {
        let name = guarded.name();
        let of = |expected: Option<&Expected>, tolerance: f64| Some((*expected?.speed_ups.get(&name)?, tolerance));
        let here = of(self.expected_here(&[&guarded.of.runner, &guarded.over.runner]), guarded.tolerance);
        let anywhere = of(self.expected(self.baselines.anywhere.as_ref()), TOLERANCE_ANYWHERE);
        let (baseline, tolerance) = here.or(anywhere).unzip();
        let verdict = baseline.zip(tolerance).map_or(Verdict::NoBaseline, |(b, tolerance)| first.judge(b, tolerance));
        SpeedUp { name, first, second: None, baseline, tolerance: tolerance.unwrap_or(guarded.tolerance), verdict }
    }

    fn fact(&self, name: &str, fact: &Fact) -> JudgedFact {
        let expected = match &fact.runner {
            Some(runner) => self.expected_here(&[runner]),
            None => self.expected(self.baselines.anywhere.as_ref()),
        };
        let baseline = expected.and_then(|expected| expected.facts.get(name)).cloned();
        JudgedFact { name: name.to_owned(), value: fact.value.clone(), baseline }
    }
}
