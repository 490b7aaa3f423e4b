//! Compares measurements with baselines.

use std::collections::BTreeMap;

use serde::Serialize;

use super::{
    baseline::{Baseline, Baselines, Expected},
    conditions::Conditions,
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

/// Tolerated loss, a fraction, of speed-ups without a baseline for this kind of machine: of the least on other kinds. The
/// work that a plan saves does not depend on the machine, but the speed of the caches does.
const TOLERANCE_ELSEWHERE: f64 = 0.4;

/// Fewer other kinds of machines than this do not tell what holds everywhere: two agreed about a software rasteriser, and
/// on the third it took three times as long.
const KINDS: usize = 3;

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
    /// What the machine was like during the measurements.
    pub(super) conditions: Vec<Conditions>,
    /// The copy rate when the baseline was measured.
    pub(super) usual_copy_gb_per_s: Option<f64>,
    /// What disturbed the measurements, if anything did.
    pub(super) disturbance: Option<String>,
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
    pub(super) baseline: Option<Standard>,
    pub(super) verdict: Verdict,
}

/// What a speed-up is held against.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Standard {
    /// The expected speed-up.
    pub(super) value: f64,
    /// The fraction of it that may be lost.
    pub(super) tolerance: f64,
    /// Whether it was measured on this kind of machine. If not, it is the least of other kinds.
    pub(super) is_of_here: bool,
}

impl Standard {
    /// The least speed-up that passes.
    pub(super) fn floor(self) -> f64 {
        self.value * (1.0 - self.tolerance)
    }
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

    fn judge(&mut self, ratio: Ratio) {
        let judge = |standard: Standard| ratio.judge(standard.value, standard.tolerance);
        self.verdict = self.baseline.map_or(Verdict::NoBaseline, judge);
    }
}

impl Judgement {
    /// Judges a first measurement.
    pub(super) fn new(gate: &Gate<'_>, baselines: &Baselines, measured: &Measured) -> Result<Self, Failure> {
        let devices = gate.runners.devices();
        let known = Known { gate, baselines };
        let expected_here = known.expected(baselines.here.as_ref());
        let usual_copy_gb_per_s = expected_here.and_then(|expected| expected.copy_gb_per_s);
        Ok(Self {
            program: machine::program()?,
            machine: gate.machine.clone(),
            quick: gate.options.quick,
            rounds: gate.options.rounds,
            baseline: baselines.path_here().display().to_string(),
            has_baseline: expected_here.is_some(),
            devices: devices.into_iter().collect(),
            unavailable: gate.runners.unavailable.clone(),
            speed_ups: measured.ratios.iter().map(|(guarded, ratio)| known.speed_up(guarded, *ratio)).collect(),
            facts: measured.facts.iter().map(|(name, fact)| known.fact(name, fact)).collect(),
            missing: known.missing(measured),
            conditions: vec![measured.conditions],
            usual_copy_gb_per_s,
            disturbance: measured.conditions.disturbance(usual_copy_gb_per_s),
            written: Vec::new(),
        })
    }

    /// Whether a speed-up is worse than the tolerance.
    pub(super) fn is_any_worse(&self) -> bool {
        self.speed_ups.iter().any(SpeedUp::is_worse)
    }

    /// Judges again the speed-ups that were worse: they fail only if they are worse both times, and nothing disturbed
    /// either measurement.
    pub(super) fn repeat(&mut self, measured: &Measured) {
        self.conditions.push(measured.conditions);
        self.disturbance = self.disturbance.take().or(measured.conditions.disturbance(self.usual_copy_gb_per_s));
        for speed_up in self.speed_ups.iter_mut().filter(|speed_up| speed_up.is_worse()) {
            let again = measured.ratios.iter().find(|(guarded, _)| guarded.name() == speed_up.name);
            speed_up.second = again.map(|&(_, ratio)| ratio);
            speed_up.judge(speed_up.second.unwrap_or(speed_up.first));
            if speed_up.is_worse() && self.disturbance.is_some() {
                speed_up.verdict = Verdict::TooNoisy;
            }
        }
    }

    /// How many speed-ups were judged, against what, and why the others were not.
    pub fn summary(&self) -> String {
        let count = |is_of: &dyn Fn(&SpeedUp) -> bool| self.speed_ups.iter().filter(|speed_up| is_of(speed_up)).count();
        let is_judged = |speed_up: &SpeedUp| !matches!(speed_up.verdict, Verdict::TooNoisy | Verdict::NoBaseline);
        let judged =
            |here| count(&|one| is_judged(one) && one.baseline.is_some_and(|standard| standard.is_of_here == here));
        let [here, elsewhere] = [true, false].map(judged);
        let noisy = count(&|one| one.verdict == Verdict::TooNoisy);
        let unknown = self.speed_ups.len() - here - elsewhere - noisy;
        let why = self.disturbance.as_deref().unwrap_or_default();
        let parts = [
            (here, "against this kind of machine".to_owned()),
            (elsewhere, format!("against the least of other kinds, less {:.0} %", 100.0 * TOLERANCE_ELSEWHERE)),
            (noisy, format!("not, because it is too noisy to judge: {why}")),
            (unknown, format!("not, because fewer than {KINDS} kinds of machines had such devices")),
        ];
        let parts: Vec<_> =
            parts.iter().filter(|part| part.0 > 0).map(|(count, what)| format!("{count} {what}")).collect();
        format!("{} of {} speed-ups were judged: {}", here + elsewhere, self.speed_ups.len(), parts.join("; "))
    }

    /// Whether this kind of machine has no baseline yet, and nothing fails or was disturbed.
    pub(super) fn calls_for_a_baseline(&self) -> bool {
        !self.has_baseline && self.failures().is_empty() && self.disturbance.is_none()
    }

    /// Whether some speed-ups were not judged.
    pub fn is_partial(&self) -> bool {
        self.speed_ups.iter().any(|speed_up| matches!(speed_up.verdict, Verdict::TooNoisy | Verdict::NoBaseline))
    }

    /// Describes the speed-ups that are worse, the results that changed, and the expected results that are missing.
    pub fn failures(&self) -> Vec<String> {
        let worse = self.speed_ups.iter().filter(|speed_up| speed_up.is_worse()).map(|speed_up| {
            let now = speed_up.second.unwrap_or(speed_up.first).median;
            let was = speed_up.baseline.map_or(f64::NAN, |standard| standard.value);
            format!("{}: {now:.2} times, was {was:.2}", speed_up.name)
        });
        let changed =
            self.facts.iter().filter(|fact| fact.has_changed()).map(|fact| {
                format!("{}: {}, was {}", fact.name, fact.value, fact.baseline.as_deref().unwrap_or_default())
            });
        let missing = self.missing.iter().map(|name| format!("{name}: in the baseline, but not measured any more"));
        worse.chain(changed).chain(missing).collect()
    }
}

/// The description of a device without what hardly changes a speed-up: the number of threads, and the width of x86
/// vectors. A machine with AVX2 reached 0.8 to 1.3 of the least that machines with AVX-512 did.
fn in_general(device: &str) -> String {
    let device =
        device.rsplit_once(", ").filter(|(_, last)| last.contains(" thread")).map_or(device, |(device, _)| device);
    device.replace("AVX-512", "AVX").replace("AVX2", "AVX")
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

    /// The least speed-up of enough other kinds of machines on which these runners used such devices.
    fn least_elsewhere(&self, name: &str, runners: &[&String]) -> Option<f64> {
        let devices = self.gate.runners.devices();
        let device = |devices: &BTreeMap<String, String>, runner| devices.get(runner).map(|device| in_general(device));
        let alike = |expected: &&Expected| {
            runners.iter().all(|&runner| device(&expected.devices, runner) == device(&devices, runner))
        };
        let others = self.baselines.elsewhere.iter().filter_map(|other| self.expected(Some(other))).filter(alike);
        let measured: Vec<_> = others.filter_map(|expected| expected.speed_ups.get(name).copied()).collect();
        let least = measured.iter().copied().min_by(f64::total_cmp);
        least.filter(|_| measured.len() >= KINDS)
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
        let runners = [&guarded.of.runner, &guarded.over.runner];
        let here = self.expected_here(&runners).and_then(|here| here.speed_ups.get(&name).copied());
        let here = here.map(|value| Standard { value, tolerance: guarded.tolerance, is_of_here: true });
        let baseline = here.or_else(|| {
            let value = self.least_elsewhere(&name, &runners)?;
            Some(Standard { value, tolerance: TOLERANCE_ELSEWHERE, is_of_here: false })
        });
        let mut speed_up = SpeedUp { name, first, second: None, baseline, verdict: Verdict::NoBaseline };
        speed_up.judge(first);
        speed_up
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
