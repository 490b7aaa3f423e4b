//! Readings of the thesis that reach its printed speed-ups of CTBP and CTCSBP.

use super::{Table, claims::printed_ratio};
use crate::report::{
    format::{number, or},
    results::Results,
};

/// A reading reaches a printed ratio if it differs by at most this fraction.
const WITHIN: f64 = 0.1;

/// How CTBP and CTCSBP share BP's work, in the model `T = T_BP (fixed + (1 - fixed) / (workers Z''''))`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Reading {
    /// The share of BP's time that neither workers nor fewer loops shorten.
    fixed: f64,
    /// Parts that advance at a time, on average.
    workers: f64,
}

impl Reading {
    /// The reading that gives both printed ratios or, where the fixed share would be negative, that of CTBP without one.
    fn of(ctbp: f64, ctcsbp: f64, z: f64) -> Self {
        let shortened = (1.0 / ctbp - 1.0 / ctcsbp) / (1.0 - 1.0 / z);
        let fixed = (1.0 / ctbp - shortened).max(0.0);
        Self { fixed, workers: (1.0 - fixed) / (1.0 / ctbp - fixed) }
    }

    /// The speed-up over BP when loops are divided by `z`.
    fn ratio(self, z: f64) -> f64 {
        1.0 / (self.fixed + (1.0 - self.fixed) / (self.workers * z))
    }
}

/// The table of readings; `None` if the run does not have all of the thesis's scenes.
pub(in crate::report) fn table(results: &Results<'_>) -> Option<Table> {
    let (ctbp, ctcsbp) = (printed_ratio(results, "ctbp")?, printed_ratio(results, "ctcsbp")?);
    let columns =
        ["Z''''", "fixed share of BP's time, %", "parts at a time", "CTBP / printed", "CTCSBP / printed", "reached"];
    let rows = [2.0, 3.0, 4.0].map(|z| {
        let reading = Reading::of(ctbp, ctcsbp, z);
        let parts = [reading.ratio(1.0) / ctbp, reading.ratio(z) / ctcsbp];
        let is_reached = parts.iter().all(|part| (part - 1.0).abs() <= WITHIN);
        let [first, second] = parts.map(|part| number(part, 2));
        let reached = or(is_reached.then(|| "yes".to_owned()), "no");
        vec![number(z, 0), number(100.0 * reading.fixed, 0), number(reading.workers, 1), first, second, reached]
    });
    let note = format!(
        "The printed times alone, in a model: T = T_BP (fixed + (1 - fixed) / (parts at a time x Z'''')). It has one fixed share \
         for both, no other work and no shorter paths. CTBP is printed {} times as fast as BP, CTCSBP {} times. A reading is \
         reached within {:.0} %. Each Z'''' has one with fewer than four parts at a time, so the printed times do not tell \
         which digit is missing.",
        number(ctbp, 2),
        number(ctcsbp, 2),
        100.0 * WITHIN
    );
    Some(Table::new("A.4", "Readings that reach the printed times of CTBP and CTCSBP", &columns).note(note).rows(rows))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reading_gives_back_the_ratios_that_it_was_made_from() {
        let reading = Reading { fixed: 0.1, workers: 3.0 };
        let again = Reading::of(reading.ratio(1.0), reading.ratio(3.0), 3.0);
        assert!((again.fixed - 0.1).abs() < 1e-9 && (again.workers - 3.0).abs() < 1e-9, "{again:?}");
        // More than twice as fast with half of the loops leaves nothing fixed.
        assert_eq!(Reading::of(2.0, 4.4, 2.0), Reading { fixed: 0.0, workers: 2.0 });
    }
}
