//! The errors of a disparity map against ground truth (Scharstein and Szeliski 2002; the thesis's equations 2.82, 2.83).

use crate::{DisparityMap, Error, Size, memory};

/// The error thresholds of the bad-pixel percentages, in pixels.
pub const THRESHOLDS: [f32; 4] = [0.5, 1.0, 2.0, 4.0];

/// The largest difference between left and right truth, in pixels, at which a pixel counts as non-occluded.
const VISIBLE_WITHIN: f32 = 1.0;

/// The ground truth of the left image, and which of its pixels are non-occluded: visible in the right image too.
#[derive(Clone, Debug, PartialEq)]
pub struct GroundTruth {
    disparities: DisparityMap,
    visible: Option<Vec<bool>>,
}

impl GroundTruth {
    /// Ground truth that does not say which pixels are non-occluded.
    #[must_use]
    pub fn new(disparities: DisparityMap) -> Self {
        Self { disparities, visible: None }
    }

    /// Ground truth with a mask of its non-occluded pixels, `[height][width]`.
    ///
    /// # Errors
    /// [`Error::PixelCount`] if `visible` does not hold one value per pixel.
    pub fn with_mask(disparities: DisparityMap, visible: Vec<bool>) -> Result<Self, Error> {
        let size = disparities.size();
        if visible.len() != size.pixels() {
            return Err(Error::PixelCount { size, found: visible.len() });
        }
        Ok(Self { disparities, visible: Some(visible) })
    }

    /// Ground truth whose non-occluded pixels follow from the truth of the right image. A pixel x is non-occluded if dL
    /// is known at x, dR is known at `x' = floor(x - dL + 1/2)` inside the image, and `|dL - dR| <= 1`.
    ///
    /// # Errors
    /// [`Error::WrongSize`] if the two maps differ in size.
    pub fn with_right(disparities: DisparityMap, right: &DisparityMap) -> Result<Self, Error> {
        let size = disparities.size();
        check_size("the right ground truth", right.size(), size)?;
        let sees = |x: usize, y: usize| {
            let truth = disparities.at(x, y)?;
            let column = (x as f32 - truth + 0.5).floor();
            let inside = column >= 0.0 && column < size.width as f32;
            let other = right.at(inside.then_some(column as usize)?, y)?;
            ((truth - other).abs() <= VISIBLE_WITHIN).then_some(())
        };
        let visible = (0..size.pixels()).map(|i| sees(i % size.width, i / size.width).is_some()).collect();
        Ok(Self { disparities, visible: Some(visible) })
    }

    /// The true disparities.
    #[must_use]
    pub fn disparities(&self) -> &DisparityMap {
        &self.disparities
    }

    /// The mask of non-occluded pixels `[height][width]`, if known.
    #[must_use]
    pub fn visible(&self) -> Option<&[bool]> {
        self.visible.as_deref()
    }

    /// The errors of `map` over all pixels with known truth, and over the non-occluded ones among them.
    ///
    /// # Errors
    /// [`Error::WrongSize`] if the map and the truth differ in size.
    pub fn errors(&self, map: &DisparityMap) -> Result<Errors, Error> {
        check_size("the disparity map", map.size(), self.disparities.size())?;
        let visible = self.visible.as_ref().map(|_| MapErrors::over(self.visible_pixels(map)));
        Ok(Errors { all: MapErrors::over(self.pixels(map)), visible })
    }

    /// How the errors of `map` are distributed over all pixels with known truth, and over the non-occluded ones among them;
    /// `None` if those are not known.
    ///
    /// # Errors
    /// [`Error::WrongSize`] if the map and the truth differ in size, [`Error::OutOfMemory`].
    pub fn distributions(&self, map: &DisparityMap) -> Result<(Distribution, Option<Distribution>), Error> {
        check_size("the disparity map", map.size(), self.disparities.size())?;
        let visible = self.visible.as_ref().map(|_| Distribution::over(map.size(), self.visible_pixels(map)));
        Ok((Distribution::over(map.size(), self.pixels(map))?, visible.transpose()?))
    }

    /// The disparities of a map with the true ones.
    fn pixels<'a>(&'a self, map: &'a DisparityMap) -> impl Iterator<Item = (f32, f32)> + 'a {
        map.values().iter().copied().zip(self.disparities.values().iter().copied())
    }

    /// Those of the non-occluded pixels.
    fn visible_pixels<'a>(&'a self, map: &'a DisparityMap) -> impl Iterator<Item = (f32, f32)> + 'a {
        let visible = self.visible.iter().flatten();
        self.pixels(map).zip(visible).filter_map(|(pixel, visible)| visible.then_some(pixel))
    }
}

/// Fails if a map has another size.
pub(crate) fn check_size(what: &'static str, found: Size, expected: Size) -> Result<(), Error> {
    if found == expected { Ok(()) } else { Err(Error::WrongSize { what, found, expected }) }
}

/// The errors of a map over two sets of pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// Over all pixels with known truth.
    pub all: MapErrors,
    /// Over the non-occluded ones; `None` if those are not known.
    pub visible: Option<MapErrors>,
}

/// The errors over a set of pixels with known truth. A figure over no pixels is NaN.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapErrors {
    /// The number of pixels with known truth (N).
    pub known: u64,
    /// How many of them have a disparity in the map. `answered / known` is the density of the map.
    pub answered: u64,
    /// The root mean squared error over answered pixels, in pixels.
    pub rmse: f64,
    /// The percentage of answered pixels with an error above each of [`THRESHOLDS`].
    pub bad: [f64; 4],
    /// The percentage of known pixels that are unanswered or have an error above each of [`THRESHOLDS`].
    pub bad_or_unanswered: [f64; 4],
}

impl MapErrors {
    fn over(pixels: impl Iterator<Item = (f32, f32)>) -> Self {
        let (mut known, mut answered, mut squares, mut wrong) = (0_u64, 0_u64, 0.0, [0_u64; 4]);
        for (disparity, truth) in pixels.filter(|(_, truth)| truth.is_finite()) {
            known += 1;
            if disparity.is_finite() {
                answered += 1;
                let error = (disparity - truth).abs();
                squares += f64::from(error) * f64::from(error);
                for (wrong, threshold) in wrong.iter_mut().zip(THRESHOLDS) {
                    *wrong += u64::from(error > threshold);
                }
            }
        }
        let percent = |part: u64, of: u64| 100.0 * part as f64 / of as f64;
        Self {
            known,
            answered,
            rmse: (squares / answered as f64).sqrt(),
            bad: wrong.map(|wrong| percent(wrong, answered)),
            bad_or_unanswered: wrong.map(|wrong| percent(wrong + known - answered, known)),
        }
    }
}

/// The errors over a set of pixels with known truth, one by one. A figure over no pixels is NaN.
#[derive(Clone, Debug, PartialEq)]
pub struct Distribution {
    /// Absolute errors, from the smallest to the largest. Those of unanswered pixels are infinite.
    errors: Vec<f32>,
    answered: usize,
    outliers: usize,
}

impl Distribution {
    fn over(size: Size, pixels: impl Iterator<Item = (f32, f32)>) -> Result<Self, Error> {
        let mut errors = memory::filled("errors", size.pixels(), 0.0)?;
        let (mut known, mut answered, mut outliers) = (0, 0, 0);
        for (disparity, truth) in pixels.filter(|(_, truth)| truth.is_finite()) {
            let error = if disparity.is_finite() { (disparity - truth).abs() } else { f32::INFINITY };
            errors[known] = error;
            known += 1;
            answered += usize::from(disparity.is_finite());
            outliers += usize::from(error > 3.0 && error > 0.05 * truth.abs());
        }
        errors.truncate(known);
        errors.sort_unstable_by(f32::total_cmp);
        Ok(Self { errors, answered, outliers })
    }

    fn percent(&self, wrong: usize) -> f64 {
        100.0 * wrong as f64 / self.errors.len() as f64
    }

    /// The number of pixels with known truth.
    #[must_use]
    pub fn known(&self) -> usize {
        self.errors.len()
    }

    /// How many of them have a disparity in the map.
    #[must_use]
    pub fn answered(&self) -> usize {
        self.answered
    }

    /// The mean absolute error over answered pixels, in pixels.
    #[must_use]
    pub fn mean(&self) -> f64 {
        self.errors[..self.answered].iter().copied().map(f64::from).sum::<f64>() / self.answered as f64
    }

    /// The root mean squared error over answered pixels, in pixels.
    #[must_use]
    pub fn rmse(&self) -> f64 {
        let squares = self.errors[..self.answered].iter().map(|&error| f64::from(error) * f64::from(error));
        (squares.sum::<f64>() / self.answered as f64).sqrt()
    }

    /// The percentage of answered pixels with an error above `threshold` pixels.
    #[must_use]
    pub fn bad(&self, threshold: f32) -> f64 {
        let right = self.errors[..self.answered].partition_point(|&error| error <= threshold);
        100.0 * (self.answered - right) as f64 / self.answered as f64
    }

    /// The percentage of known pixels that are unanswered or have an error above `threshold` pixels.
    #[must_use]
    pub fn bad_or_unanswered(&self, threshold: f32) -> f64 {
        self.percent(self.errors.len() - self.errors.partition_point(|&error| error <= threshold))
    }

    /// The error that `percent` % of the known pixels do not exceed, in pixels: A50, A90 and so on of Middlebury's evaluation.
    /// Infinite, if too few are answered.
    #[must_use]
    pub fn quantile(&self, percent: u32) -> f64 {
        let rank = (self.errors.len() * percent as usize).div_ceil(100);
        self.errors.get(rank.saturating_sub(1)).copied().map_or(f64::NAN, f64::from)
    }

    /// D1 of the KITTI benchmark (Menze and Geiger 2015): the percentage of known pixels that are unanswered or wrong by more
    /// than 3 pixels and more than 5 % of the truth.
    #[must_use]
    pub fn d1(&self) -> f64 {
        self.percent(self.outliers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NONE: f32 = DisparityMap::UNKNOWN;

    fn map(values: &[f32]) -> DisparityMap {
        DisparityMap::new(Size { width: values.len(), height: 1 }, values.to_vec()).unwrap()
    }

    #[test]
    fn unknown_truth_is_left_out_and_unanswered_pixels_are_counted_apart() {
        let truth = GroundTruth::new(map(&[1.0, 2.0, NONE, 4.0, 5.0]));
        let errors = truth.errors(&map(&[1.0, 3.0, 9.0, NONE, 8.0])).unwrap();
        assert_eq!((errors.all.known, errors.all.answered, errors.visible), (4, 3, None));
        assert_eq!(errors.all.rmse, (10.0_f64 / 3.0).sqrt());
        assert_eq!(errors.all.bad, [2, 1, 1, 0].map(|n: u32| 100.0 * f64::from(n) / 3.0));
        assert_eq!(errors.all.bad_or_unanswered, [75.0, 50.0, 50.0, 25.0]);
    }

    #[test]
    fn an_error_of_exactly_the_threshold_is_not_bad() {
        let errors = GroundTruth::new(map(&[1.0])).errors(&map(&[2.0])).unwrap();
        assert_eq!(errors.all.bad, [100.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn visible_pixels_agree_with_the_right_truth() {
        let left = map(&[0.0, 1.5, 1.0, 1.0, NONE, 9.0]);
        let right = map(&[0.0, 3.0, NONE, 1.0, 1.0, 1.0]);
        let truth = GroundTruth::with_right(left, &right).unwrap();
        // Pixel 1 maps to column 0 and differs by 1.5, 2 maps to 1 and differs by 2, 3 maps to an unknown pixel, 5
        // leaves the image.
        assert_eq!(truth.visible(), Some([true, false, false, false, false, false].as_slice()));
        let errors = truth.errors(&map(&[0.0; 6])).unwrap();
        assert_eq!(errors.visible.map(|visible| visible.known), Some(1));
        assert!(GroundTruth::with_right(map(&[1.0]), &right).is_err());
        assert!(GroundTruth::with_mask(map(&[1.0]), vec![]).is_err());
    }

    #[test]
    fn a_distribution_agrees_with_the_errors_and_counts_unanswered_pixels_last() {
        let truth =
            GroundTruth::with_mask(map(&[1.0, 2.0, NONE, 4.0, 5.0, 100.0]), vec![true, true, true, false, false, true]);
        let (truth, map) = (truth.unwrap(), map(&[1.0, 2.5, 9.0, NONE, 8.0, 104.0]));
        let (all, visible) = truth.distributions(&map).unwrap();
        let errors = truth.errors(&map).unwrap();
        for (found, expected) in [(&all, errors.all), (visible.as_ref().unwrap(), errors.visible.unwrap())] {
            assert_eq!((found.known() as u64, found.answered() as u64), (expected.known, expected.answered));
            assert_eq!(found.rmse(), expected.rmse);
            assert_eq!(THRESHOLDS.map(|threshold| found.bad(threshold)), expected.bad);
            assert_eq!(THRESHOLDS.map(|threshold| found.bad_or_unanswered(threshold)), expected.bad_or_unanswered);
        }
        assert_eq!(all.mean(), 7.5 / 4.0);
        let quantiles = [1, 20, 21, 50, 80, 81, 100].map(|percent| all.quantile(percent));
        assert_eq!(quantiles, [0.0, 0.0, 0.5, 3.0, 4.0, f64::INFINITY, f64::INFINITY]);
        // 3 px are not more than 3 px, and 4 px not more than 5 % of 100 px.
        assert_eq!(all.d1(), 20.0);
    }

    #[test]
    fn outliers_are_wrong_by_both_measures() {
        let (all, _) =
            GroundTruth::new(map(&[10.0, 60.0, 90.0, 90.0])).distributions(&map(&[13.1, 63.5, 94.4, 94.6])).unwrap();
        assert_eq!(all.d1(), 75.0);
    }

    #[test]
    fn nothing_measured_is_not_a_perfect_score() {
        let nothing_known = GroundTruth::new(map(&[NONE])).errors(&map(&[1.0])).unwrap().all;
        assert!(nothing_known.rmse.is_nan() && nothing_known.bad_or_unanswered[1].is_nan());
        let nothing_answered = GroundTruth::new(map(&[1.0])).errors(&map(&[NONE])).unwrap().all;
        assert!(nothing_answered.rmse.is_nan() && nothing_answered.bad[1].is_nan());
        assert_eq!(nothing_answered.bad_or_unanswered, [100.0; 4]);
        let (nothing, _) = GroundTruth::new(map(&[NONE])).distributions(&map(&[1.0])).unwrap();
        let figures = [nothing.mean(), nothing.rmse(), nothing.bad(1.0), nothing.quantile(50), nothing.d1()];
        assert!(figures.into_iter().all(f64::is_nan));
    }
}
