//! The statistics of all experiments: medians with their range, and intervals of medians and of ratios of medians.
//!
//! Every experiment uses medians, because other work on the machine only ever makes a program slower, sometimes much
//! slower. That would shift a mean.

use std::fmt;

use bp_charts::number;
use fastrand::Rng;

/// Resamples of the bootstrap.
const RESAMPLES: usize = 2000;

/// The seed of the bootstrap is fixed, so that the same samples give the same interval.
const SEED: u64 = 0x9e37_79b9_7f4a_7c15;

/// Fewer samples say nothing about how they scatter.
const FEWEST_SAMPLES: usize = 3;

/// The median and range of some numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// The median.
    pub median: f64,
    /// The least value.
    pub low: f64,
    /// The greatest value.
    pub high: f64,
    /// The number of values.
    pub count: usize,
}

impl Spread {
    /// The spread of some numbers; `None` if there are none.
    pub fn of(numbers: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut sorted: Vec<f64> = numbers.into_iter().collect();
        sorted.sort_by(f64::total_cmp);
        let (&low, &high) = (sorted.first()?, sorted.last()?);
        let middle = sorted.len() / 2;
        let median = if sorted.len() % 2 == 1 { sorted[middle] } else { (sorted[middle - 1] + sorted[middle]) / 2.0 };
        Some(Self { median, low, high, count: sorted.len() })
    }

    /// The mean of some medians; `None` if there are none.
    pub fn mean(medians: impl IntoIterator<Item = f64>) -> Option<f64> {
        let (sum, count) = medians.into_iter().fold((0.0, 0), |(sum, count), value| (sum + value, count + 1));
        (count > 0).then(|| sum / f64::from(count))
    }
}

impl fmt::Display for Spread {
    /// The median, followed by the range if there are three numbers or more.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let digits = if self.median < 1000.0 { 1 } else { 0 };
        write!(f, "{}", number(self.median, digits))?;
        if self.count >= FEWEST_SAMPLES {
            write!(f, " ({} to {})", number(self.low, digits), number(self.high, digits))?;
        }
        Ok(())
    }
}

/// The median of some numbers; `None` if there are none.
pub(crate) fn median(numbers: impl IntoIterator<Item = f64>) -> Option<f64> {
    Spread::of(numbers).map(|spread| spread.median)
}

/// The mean over the scenes of the median of each scene's samples; `None` if a scene has no samples.
pub(crate) fn mean_of_medians(scenes: &[Vec<f64>]) -> Option<f64> {
    Spread::mean(scenes.iter().map(|samples| median(samples.iter().copied())).collect::<Option<Vec<f64>>>()?)
}

/// A 95 % interval of that mean by the percentile bootstrap; `None` if a scene has too few samples.
pub(crate) fn interval(scenes: &[Vec<f64>]) -> Option<[f64; 2]> {
    percentiles(|random| resampled(scenes, random))
}

/// The same for the ratio of two such means whose samples were not taken in turns. No sample of one side belongs to a
/// sample of the other, so each side is resampled by itself.
pub(crate) fn ratio_interval(scenes: &[Vec<f64>], base: &[Vec<f64>]) -> Option<[f64; 2]> {
    percentiles(|random| Some(resampled(scenes, random)? / resampled(base, random)?))
}

/// The same mean over resampled scenes: each draws as many samples as it has, with replacement.
fn resampled(scenes: &[Vec<f64>], random: &mut Rng) -> Option<f64> {
    let mut redrawn = |samples: &Vec<f64>| {
        let count = samples.len();
        let drawn = (0..count).map(|_| samples[random.usize(..count)]);
        median(drawn).filter(|_| count >= FEWEST_SAMPLES)
    };
    Spread::mean(scenes.iter().map(&mut redrawn).collect::<Option<Vec<f64>>>()?)
}

fn percentiles(mut draw: impl FnMut(&mut Rng) -> Option<f64>) -> Option<[f64; 2]> {
    let mut random = Rng::with_seed(SEED);
    let mut drawn = (0..RESAMPLES).map(|_| draw(&mut random)).collect::<Option<Vec<f64>>>()?;
    drawn.sort_by(f64::total_cmp);
    let ends = [0.025, 0.975].map(|quantile| drawn[(quantile * (RESAMPLES - 1) as f64).round() as usize]);
    ends.iter().all(|end| end.is_finite()).then_some(ends)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn around(middle: f64) -> Vec<f64> {
        [-0.2, -0.1, 0.0, 0.1, 0.2].map(|offset| middle + offset).to_vec()
    }

    #[test]
    fn intervals_hold_the_median_and_are_the_same_every_time() {
        let scenes = [around(10.0), around(20.0)];
        assert!((mean_of_medians(&scenes).unwrap() - 15.0).abs() < 1e-12);
        let [low, high] = interval(&scenes).unwrap();
        assert!((14.8..15.0).contains(&low) && high > 15.0 && high <= 15.2, "{low} {high}");
        assert_eq!(interval(&scenes), Some([low, high]));
    }

    #[test]
    fn samples_that_never_vary_leave_no_doubt() {
        let (three, four) = (vec![3.0; 3], vec![4.0; 7]);
        assert_eq!(interval(std::slice::from_ref(&three)), Some([3.0, 3.0]));
        assert_eq!(ratio_interval(&[three], &[four]), Some([0.75, 0.75]));
    }

    /// The interval detects a doubling, and contains 1 for noise around the same median.
    #[test]
    fn intervals_of_ratios_tell_a_change_from_none() {
        let [low, high] = ratio_interval(&[around(20.0)], &[around(10.0)]).unwrap();
        assert!((1.9..2.0).contains(&low) && high > 2.0 && high < 2.1, "{low} {high}");
        let [low, high] = ratio_interval(&[around(10.0)], &[around(10.0)]).unwrap();
        assert!(low < 1.0 && high > 1.0, "resampled independently, the sides differ: {low} {high}");
    }

    #[test]
    fn too_few_samples_have_no_interval() {
        assert_eq!(interval(&[around(1.0), vec![1.0, 2.0]]), None);
        assert_eq!(ratio_interval(&[around(1.0)], &[vec![1.0]]), None);
        assert_eq!(ratio_interval(&[around(1.0)], &[vec![0.0; 3]]), None, "not a number");
        assert_eq!([interval(&[]), interval(&[vec![]])], [None, None]);
        assert_eq!([mean_of_medians(&[]), mean_of_medians(&[vec![1.0], vec![]])], [None, None]);
        assert_eq!(mean_of_medians(&[vec![1.0]]), Some(1.0));
    }

    #[test]
    fn spreads_have_a_range_from_three_numbers_on() {
        assert_eq!(Spread::of([3.0, 1.0, 2.0]).unwrap().to_string(), "2.0 (1.0 to 3.0)");
        assert_eq!(Spread::of([3000.0, 1000.0]).unwrap().to_string(), "2,000");
        assert_eq!((Spread::of([]), Spread::mean([1.0, 2.0])), (None, Some(1.5)));
    }
}
