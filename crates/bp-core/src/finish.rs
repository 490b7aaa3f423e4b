//! Operations on disparity maps after matching, the same for all backends: checks, filling, filters and confidence.
//!
//! [`Finish`] selects some of them and applies them in a fixed order: left-right check, sub-pixel, uniqueness, speckles, fill,
//! median.

mod border;
mod check;
mod claims;
mod confidence;
mod fill;
mod means;
mod median;
mod offsets;
mod rows;
mod speckles;
mod subpixel;
mod unique;
mod variances;
mod window;

pub use border::fill_border;
pub use check::{AGREE, check_left_right};
pub use confidence::{FILLED, confidence};
pub use fill::fill;
pub use median::{MEDIANS, median};
pub use offsets::window_bytes;
pub use speckles::{remove_speckles, speckle_bytes};
pub use subpixel::subpixel;
pub use unique::check_unique;

use crate::{DisparityMap, Error, IsStopped, StereoPair};

/// The operations that a disparity map goes through after matching; by default none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Finish {
    /// Whether [`check_left_right`] makes pixels unknown that contradict the right image's map.
    pub check: bool,
    /// Whether pixels become unknown whose match fits another pixel better; see [`check_unique`].
    pub unique: bool,
    /// Makes surfaces with fewer pixels than this unknown; see [`remove_speckles`].
    pub speckles: Option<usize>,
    /// Whether unknown pixels are filled after the checks and the speckles; see [`fill_border`]
    /// and [`fill()`].
    pub fill: bool,
    /// The side of the window of [`median`], one of [`MEDIANS`].
    pub median: Option<usize>,
    /// Whether [`subpixel`] refines disparities to fractions of a pixel.
    pub subpixel: bool,
}

impl Finish {
    /// Applies the selected operations to the left image's map: [`Finish::judge`], then [`Finish::complete`].
    ///
    /// # Errors
    /// As both.
    pub fn apply(
        &self,
        pair: &StereoPair,
        left: DisparityMap,
        right: Option<&DisparityMap>,
        is_stopped: IsStopped<'_>,
    ) -> Result<DisparityMap, Error> {
        self.complete(self.judge(pair, left, right, is_stopped)?, is_stopped)
    }

    /// Applies those that find wrong pixels and fractions. `right` is the right image's map, for the check.
    ///
    /// # Errors
    /// [`Error::WrongSize`] if the two maps or, for fractions and uniqueness, the pair differ in size; [`Error::Plan`] for a check
    /// without the right image's map; [`Error::OutOfMemory`]; [`Error::Stopped`].
    pub fn judge(
        &self,
        pair: &StereoPair,
        left: DisparityMap,
        right: Option<&DisparityMap>,
        is_stopped: IsStopped<'_>,
    ) -> Result<DisparityMap, Error> {
        let mut map = match (self.check, right) {
            (false, _) => left,
            (true, Some(right)) => check_left_right(left, right)?,
            (true, None) => return Err(Error::Plan("a left-right check needs the right image's map too")),
        };
        if self.subpixel {
            map = subpixel(pair, map, self.unique, is_stopped)?;
        } else if self.unique {
            map = check_unique(pair, map, is_stopped)?;
        }
        if let Some(least) = self.speckles {
            map = remove_speckles(map, least)?;
        }
        Ok(map)
    }

    /// Fills and filters a map that has been judged.
    ///
    /// # Errors
    /// [`Error::Plan`] for a median that is not one of [`MEDIANS`]; [`Error::OutOfMemory`]; [`Error::Stopped`].
    pub fn complete(&self, judged: DisparityMap, is_stopped: IsStopped<'_>) -> Result<DisparityMap, Error> {
        let map = if self.fill { fill(fill_border(judged, !self.subpixel)?) } else { judged };
        if let Some(side) = self.median { median(&map, side, is_stopped) } else { Ok(map) }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;
    use crate::{Image, Size, never};

    const NONE: f32 = DisparityMap::UNKNOWN;

    fn map(width: usize, values: &[f32]) -> DisparityMap {
        DisparityMap::new(Size { width, height: values.len() / width }, values.to_vec()).unwrap()
    }

    /// A pair of blank images.
    fn pair(width: usize) -> StereoPair {
        let image = || Image::from_grey(width, 1, vec![0; width]).unwrap();
        StereoPair::new(image(), image()).unwrap()
    }

    #[test]
    fn nothing_is_done_by_default() {
        let original = map(3, &[1.0, NONE, 7.0]);
        assert_eq!(Finish::default().apply(&pair(3), original.clone(), None, &never).unwrap(), original);
    }

    #[test]
    fn holes_of_the_check_are_filled_before_filters_see_them() {
        // The right map contradicts pixel 3. The value that fills it survives the median.
        let left = map(5, &[0.0, 0.0, 0.0, 3.0, 0.0]);
        let right = map(5, &[0.0; 5]);
        let finish = Finish { check: true, fill: true, median: Some(3), ..Finish::default() };
        assert_eq!(finish.apply(&pair(5), left.clone(), Some(&right), &never).unwrap(), map(5, &[0.0; 5]));
        assert!(finish.apply(&pair(5), left.clone(), None, &never).is_err());
        assert!(finish.apply(&pair(5), left, Some(&map(1, &[0.0])), &never).is_err());
    }

    #[test]
    fn long_operations_can_be_stopped() {
        let flat = map(5, &[1.0; 5]);
        for finish in [Finish { median: Some(3), ..Finish::default() }, Finish { subpixel: true, ..Finish::default() }]
        {
            let asked = AtomicUsize::new(0);
            let second = || asked.fetch_add(1, Ordering::Relaxed) == 1;
            let stopped = finish.apply(&pair(5), flat.clone(), None, &|| true);
            assert_eq!(stopped, Err(Error::Stopped));
            let rows = finish.apply(&pair(5), flat.clone(), None, &second);
            assert_eq!(rows.is_err(), finish.subpixel, "a row of three operations, and one of one");
        }
        assert_eq!(confidence(&flat, &flat, &|| true), Err(Error::Stopped));
    }

    #[test]
    fn a_map_of_unknown_pixels_stays_one() {
        let all = Finish { check: true, unique: true, speckles: Some(2), fill: true, median: Some(5), subpixel: true };
        let unknown = map(2, &[NONE; 4]);
        let image = || Image::from_grey(2, 2, [0; 4]).unwrap();
        let blank = StereoPair::new(image(), image()).unwrap();
        assert_eq!(all.apply(&blank, unknown.clone(), Some(&unknown), &never).unwrap(), unknown);
    }
}
