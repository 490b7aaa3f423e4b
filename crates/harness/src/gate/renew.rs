//! New baselines from measurements.

use std::collections::BTreeMap;

use super::{
    baseline::{Baseline, Baselines, Expected},
    measure::{Fact, Measured},
    subject::{Gate, Renewal},
};
use crate::{failure::Failure, machine, statistics::median};

impl Gate<'_> {
    /// Puts the measurements into the baselines and writes them; returns the names of the files.
    pub(super) fn renew(
        &self,
        renewal: Renewal,
        baselines: &mut Baselines,
        measured: &[Measured],
    ) -> Result<Vec<String>, Failure> {
        let here = baselines.here.get_or_insert_with(|| Baseline::new(Some(&self.machine)));
        let rate = median(measured.iter().map(|measured| measured.conditions.copy_gb_per_s));
        let of_runners = Expected {
            speed_ups: speed_ups(measured),
            copy_gb_per_s: rate.map(rounded),
            ..self.expected(measured, |fact| fact.runner.is_some())
        };
        here.runs.insert(self.setting().to_owned(), of_runners);
        if renewal == Renewal::Everywhere {
            let of_all = self.expected(measured, |fact| fact.runner.is_none());
            let anywhere = baselines.anywhere.get_or_insert_with(|| Baseline::new(None));
            anywhere.runs.insert(self.setting().to_owned(), of_all);
        }
        baselines.write(renewal)
    }

    /// The chosen facts.
    fn expected(&self, measured: &[Measured], is_told: impl Fn(&Fact) -> bool) -> Expected {
        let facts = measured.iter().flat_map(|measured| &measured.facts).filter(|(_, fact)| is_told(fact));
        Expected {
            commit: machine::commit(),
            devices: self.runners.devices(),
            facts: facts.map(|(name, fact)| (name.clone(), fact.value.clone())).collect(),
            ..Expected::default()
        }
    }
}

/// The median of each speed-up over the measurements.
fn speed_ups(measured: &[Measured]) -> BTreeMap<String, f64> {
    let mut all = BTreeMap::<_, Vec<_>>::new();
    for (guarded, ratio) in measured.iter().flat_map(|measured| &measured.ratios) {
        all.entry(guarded.name()).or_default().push(ratio.median);
    }
    all.into_iter().filter_map(|(name, medians)| Some((name, rounded(median(medians)?)))).collect()
}

/// To three decimals.
fn rounded(value: f64) -> f64 {
    (1000.0 * value).round() / 1000.0
}
