//! New baselines from measurements.

use super::{
    baseline::{Baseline, Baselines, Expected},
    guarded::Guarded,
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
        let of_runners = self.expected(measured, |_| true, |fact| fact.runner.is_some());
        here.runs.insert(self.setting().to_owned(), of_runners);
        if renewal == Renewal::Everywhere {
            let reference = &self.runners.lineup.reference;
            let is_of_reference =
                |guarded: &Guarded| [&guarded.of, &guarded.over].iter().all(|s| s.runner == *reference);
            let of_all = self.expected(measured, is_of_reference, |fact| fact.runner.is_none());
            let anywhere = baselines.anywhere.get_or_insert_with(|| Baseline::new(None));
            anywhere.runs.insert(self.setting().to_owned(), of_all);
        }
        baselines.write(renewal)
    }

    /// The chosen speed-ups, each the median over the measurements, and the chosen facts.
    fn expected(
        &self,
        measured: &[Measured],
        is_expected: impl Fn(&Guarded) -> bool,
        is_told: impl Fn(&Fact) -> bool,
    ) -> Expected {
        let ratios = || measured.iter().flat_map(|measured| &measured.ratios);
        let median_of = |name: &str| {
            let own = ratios().filter(|(guarded, _)| guarded.name() == name);
            median(own.map(|(_, ratio)| ratio.median)).map(|median| (1000.0 * median).round() / 1000.0)
        };
        let names = ratios().filter(|(guarded, _)| is_expected(guarded)).map(|(guarded, _)| guarded.name());
        let facts = measured.iter().flat_map(|measured| &measured.facts).filter(|(_, fact)| is_told(fact));
        Expected {
            commit: machine::commit(),
            devices: self.runners.devices(),
            speed_ups: names.filter_map(|name| Some((name.clone(), median_of(&name)?))).collect(),
            facts: facts.map(|(name, fact)| (name.clone(), fact.value.clone())).collect(),
        }
    }
}
