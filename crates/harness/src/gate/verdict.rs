//! The rule by which a speed-up passes or fails.

use serde::Serialize;

use crate::statistics::{interval, median};

/// A measured speed-up.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Ratio {
    /// Median over the rounds.
    pub(super) median: f64,
    /// Lower end of its 95 % interval.
    pub(super) low: f64,
    /// Upper end of its 95 % interval.
    pub(super) high: f64,
}

/// How a speed-up compares with its baseline.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Verdict {
    /// The interval overlaps the range that the baseline tolerates.
    AsBefore,
    /// The whole interval is above that range: the baseline should be renewed.
    Better,
    /// The whole interval is below that range.
    Worse,
    /// It was worse, but something disturbed a measurement.
    TooNoisy,
    /// No baseline to compare with.
    NoBaseline,
}

impl Ratio {
    /// Computes it from the rounds' ratios; `None` if they are too few for an interval, or not numbers.
    pub(super) fn of(rounds: &[f64]) -> Option<Self> {
        let [low, high] = interval(&[rounds.to_vec()])?;
        Some(Self { median: median(rounds.iter().copied())?, low, high })
    }

    /// Compares with a baseline. A change by less than the fraction `tolerance` does not count.
    pub(super) fn judge(self, baseline: f64, tolerance: f64) -> Verdict {
        if self.high < baseline * (1.0 - tolerance) {
            Verdict::Worse
        } else if self.low > baseline / (1.0 - tolerance) {
            Verdict::Better
        } else {
            Verdict::AsBefore
        }
    }
}

impl Verdict {
    /// The word in tables.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::AsBefore => "as before",
            Self::Better => "better",
            Self::Worse => "WORSE",
            Self::TooNoisy => "too noisy",
            Self::NoBaseline => "no baseline",
        }
    }
}

#[cfg(test)]
mod tests {
    use fastrand::Rng;

    use super::*;

    /// Noisy ratios of ten rounds around `middle`: most within 3 %, about one in ten far below.
    fn rounds(middle: f64, random: &mut Rng) -> Vec<f64> {
        let mut round = |_| {
            let stray = if random.u8(..10) == 0 { 1.0 - 0.4 * random.f64() } else { 1.0 };
            middle * stray * (1.0 + 0.03 * (2.0 * random.f64() - 1.0))
        };
        (0..10).map(&mut round).collect()
    }

    /// How many of 1000 measurements are worse both at first and when repeated.
    fn alarms(speed_up: f64) -> usize {
        let random = &mut Rng::with_seed(1);
        let mut worse = || Ratio::of(&rounds(speed_up, random)).unwrap().judge(50.0, 0.12) == Verdict::Worse;
        (0..1000).filter(|_| worse() && worse()).count()
    }

    #[test]
    fn noise_raises_no_alarm_and_a_kernel_slowed_by_30_percent_always_does() {
        assert_eq!(alarms(50.0), 0, "nothing changed");
        assert_eq!(alarms(50.0 / 1.05), 0, "5 % is within the tolerance");
        assert_eq!(alarms(50.0 / 1.3), 1000);
    }

    #[test]
    fn only_a_whole_interval_beyond_the_tolerance_is_a_difference() {
        let judge = |low, high| Ratio { median: f64::midpoint(low, high), low, high }.judge(10.0, 0.2);
        assert_eq!([judge(7.0, 7.99), judge(7.0, 8.0)], [Verdict::Worse, Verdict::AsBefore]);
        assert_eq!([judge(12.5, 14.0), judge(12.51, 14.0)], [Verdict::AsBefore, Verdict::Better]);
        assert_eq!(judge(1.0, 100.0), Verdict::AsBefore, "so wide an interval says nothing");
    }

    #[test]
    fn too_few_rounds_or_no_numbers_are_no_ratio() {
        assert_eq!(Ratio::of(&[1.0, 2.0]), None);
        assert_eq!(Ratio::of(&[1.0, f64::NAN, 2.0]), None);
        assert_eq!(Ratio::of(&[2.0, 1.0, 3.0]).map(|ratio| ratio.median), Some(2.0));
    }
}
