//! The left-right check.

use fearless_simd::{Level, Simd, dispatch};
use rayon::prelude::*;

use crate::{DisparityMap, Error, metrics::check_size};

/// Two disparities agree, and belong to one surface, if they differ by no more than this many pixels.
pub const AGREE: f32 = 1.0;

/// Makes every pixel of the left map unknown unless its match in the right image agrees: the right map at column
/// `floor(x - d + 1/2)` must be known and differ by no more than [`AGREE`] (Fua 1993). Occluded pixels fail this check,
/// and so do most wrong ones.
///
/// # Errors
/// [`Error::WrongSize`] if the maps differ in size.
pub fn check_left_right(left: DisparityMap, right: &DisparityMap) -> Result<DisparityMap, Error> {
    check_size("the right image's map", right.size(), left.size())?;
    let (width, level) = (left.size().width, Level::new());
    Ok(left.replaced(|values| {
        let rows = values.par_chunks_exact_mut(width).zip(right.values().par_chunks_exact(width));
        rows.for_each(|(row, right)| dispatch!(level, simd => check_row(simd, row, right)));
    }))
}

#[inline(always)]
fn check_row<S: Simd>(simd: S, row: &mut [f32], right: &[f32]) {
    simd.vectorize(
        #[inline(always)]
        || {
            for (x, disparity) in row.iter_mut().enumerate() {
                if difference(x, *disparity, right).is_none_or(|difference| difference > AGREE) {
                    *disparity = DisparityMap::UNKNOWN;
                }
            }
        },
    );
}

/// The difference between the disparity of column `x` and that of its match in the right map's row; `None` if either
/// is unknown or the match lies outside.
#[inline(always)]
pub(super) fn difference(x: usize, disparity: f32, right: &[f32]) -> Option<f32> {
    let column = (x as f32 - disparity + 0.5).floor();
    // This comes before the conversion to an index, because unknown disparities are infinite.
    let inside = column >= 0.0 && column < right.len() as f32;
    let other = right[inside.then_some(column as usize)?];
    other.is_finite().then(|| (disparity - other).abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Size;

    const NONE: f32 = DisparityMap::UNKNOWN;

    fn row(values: &[f32]) -> DisparityMap {
        DisparityMap::new(Size { width: values.len(), height: 1 }, values.to_vec()).unwrap()
    }

    #[test]
    fn pixels_have_to_agree_with_their_match() {
        // Match: outside, column 0 (differs by 1), column 1 (by 2), column 2 (unknown), none, column 3.
        let left = row(&[1.0, 1.0, 1.0, 1.0, NONE, 2.0]);
        let right = row(&[2.0, 3.0, NONE, 2.0, 0.0, 0.0]);
        assert_eq!(check_left_right(left, &right).unwrap(), row(&[NONE, 1.0, NONE, NONE, NONE, 2.0]));
        assert!(check_left_right(row(&[0.0]), &right).is_err());
    }

    #[test]
    fn disparities_may_be_negative() {
        let left = row(&[-1.0, -1.0, -1.0]);
        assert_eq!(check_left_right(left, &row(&[5.0, -1.0, -3.0])).unwrap(), row(&[-1.0, NONE, NONE]));
    }
}
