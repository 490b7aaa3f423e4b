//! How sure medians, and ratios of medians, are.

use fastrand::Rng;

use crate::report::format::Spread;

/// Resamples of the bootstrap.
const RESAMPLES: usize = 2000;

/// Where the random numbers begin: the same samples give the same interval.
const SEED: u64 = 0x9e37_79b9_7f4a_7c15;

/// Fewer samples of a scene say nothing about how they scatter.
const FEWEST_SAMPLES: usize = 3;

/// Times in milliseconds: the samples of each scene.
pub(crate) type Samples = [Vec<f64>];

/// The mean over the scenes of the median of each; `None` where one has no samples.
pub(crate) fn mean_of_medians(scenes: &Samples) -> Option<f64> {
    let medians = scenes.iter().map(|samples| Some(Spread::of(samples.iter().copied())?.median));
    Spread::mean(medians.collect::<Option<Vec<f64>>>()?)
}

/// A 95 % interval of that mean by the percentile bootstrap; `None` where a scene has too few samples.
pub(crate) fn interval(scenes: &Samples) -> Option<[f64; 2]> {
    percentiles(|random| resampled(scenes, random))
}

/// The same of the ratio of two such means. The two sides were not measured in turns, so that no sample of one belongs
/// to any of the other: each is resampled for itself.
pub(crate) fn ratio_interval(scenes: &Samples, base: &Samples) -> Option<[f64; 2]> {
    percentiles(|random| Some(resampled(scenes, random)? / resampled(base, random)?))
}

/// The mean of medians of as many samples of each scene, drawn with replacement.
fn resampled(scenes: &Samples, random: &mut Rng) -> Option<f64> {
    let mut median = |samples: &Vec<f64>| {
        let count = samples.len();
        let drawn = (0..count).map(|_| samples[random.usize(..count)]);
        Spread::of(drawn).filter(|_| count >= FEWEST_SAMPLES).map(|spread| spread.median)
    };
    Spread::mean(scenes.iter().map(&mut median).collect::<Option<Vec<f64>>>()?)
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

    /// Doubling is found, and noise about the same median holds 1.
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
}
