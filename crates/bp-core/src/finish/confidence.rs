//! How far a map can be trusted.

use fearless_simd::{Level, Simd, dispatch};
use rayon::prelude::*;

use super::{
    check::{AGREE, difference},
    window::{Frame, Framed, window},
};
use crate::{DisparityMap, Error, IsStopped, memory, metrics::check_size, stop::go_on};

/// How far the window reaches from its centre.
const REACH: usize = 4;

/// The pixels of a window.
const PIXELS: f32 = ((2 * REACH + 1) * (2 * REACH + 1)) as f32;

/// The share of pixels that are right to one pixel where the mean worth is 0, 1/4, 1/2, 3/4 and 1: least squares over the
/// thesis's six pairs at half size. `scripts/evaluate-confidence` checks this on others.
const PROBABILITIES: [f32; 5] = [0.22, 0.53, 0.7, 0.93, 1.0];

/// The confidence of pixels that a check or the speckle filter made unknown and that were then filled: the share of them that
/// are right to one pixel, of the thesis's six pairs at half size. `scripts/evaluate-confidence` checks it on others.
pub const FILLED: f32 = 0.56;

/// The confidence of each pixel of the left map, `[height][width]`: about the probability that its disparity is right to one
/// pixel; 0 if it is unknown.
///
/// It depends on the mean worth of the pixels in the 9x9 window. A pixel that differs from the centre by no more than [`AGREE`] is
/// worth 1 if its match in the right map has the same disparity, and half if that differs by no more than [`AGREE`]. All
/// other pixels, and those outside the image, are worth nothing. Linear interpolation in a table gives the probability.
/// The measure is ours; docs/algorithms.md compares it with others.
///
/// # Errors
/// [`Error::WrongSize`] if the maps differ in size, [`Error::OutOfMemory`], [`Error::Stopped`].
pub fn confidence(left: &DisparityMap, right: &DisparityMap, is_stopped: IsStopped<'_>) -> Result<Vec<f32>, Error> {
    check_size("the right image's map", right.size(), left.size())?;
    let size = left.size();
    let (width, level) = (size.width, Level::new());
    let mut worths = memory::filled("worths", size.pixels(), 0.0)?;
    let rows = left.values().par_chunks_exact(width).zip(right.values().par_chunks_exact(width));
    rows.zip(worths.par_chunks_exact_mut(width)).for_each(|((left, right), worths)| {
        dispatch!(level, simd => write_worths(simd, left, right, worths));
    });
    let disparities = Framed::new(size, left.values(), REACH, Frame::Unknown)?;
    let framed = Framed::new(size, &worths, REACH, Frame::Unknown)?;
    // Their memory is used for the sums.
    let mut sums = worths;
    let rows = sums.par_chunks_exact_mut(width).zip(left.values().par_chunks_exact(width)).enumerate();
    rows.try_for_each(|(y, (sums, row))| {
        go_on(is_stopped)?;
        sums.fill(0.0);
        for (dx, dy) in window(REACH) {
            let (near, worths) = (disparities.row(y, dx, dy), framed.row(y, dx, dy));
            dispatch!(level, simd => add_worths(simd, row, near, worths, sums));
        }
        dispatch!(level, simd => write_probabilities(simd, row, sums));
        Ok(())
    })?;
    Ok(sums)
}

#[inline(always)]
fn write_worths<S: Simd>(simd: S, left: &[f32], right: &[f32], worths: &mut [f32]) {
    simd.vectorize(
        #[inline(always)]
        || {
            for (x, (worth, &disparity)) in worths.iter_mut().zip(left).enumerate() {
                *worth = worth_of(x, disparity, right);
            }
        },
    );
}

/// Writes the probabilities of a row, given the sums of the worths in the windows.
#[inline(always)]
fn write_probabilities<S: Simd>(simd: S, row: &[f32], sums: &mut [f32]) {
    simd.vectorize(
        #[inline(always)]
        || {
            for (sum, disparity) in sums.iter_mut().zip(row) {
                let share = *sum / PIXELS;
                *sum = if disparity.is_finite() { probability(share) } else { 0.0 };
            }
        },
    );
}

/// The probability for a mean worth from 0 to 1.
#[inline(always)]
fn probability(share: f32) -> f32 {
    let steps = (PROBABILITIES.len() - 1) as f32;
    let first = (share * steps).min(steps - 1.0) as usize;
    let part = share * steps - first as f32;
    PROBABILITIES[first] + part * (PROBABILITIES[first + 1] - PROBABILITIES[first])
}

/// The worth of a single pixel.
#[inline(always)]
fn worth_of(x: usize, disparity: f32, right: &[f32]) -> f32 {
    match difference(x, disparity, right) {
        Some(0.0) => 1.0,
        Some(difference) if difference <= AGREE => 0.5,
        _ => 0.0,
    }
}

/// Adds the worths of neighbours with a similar disparity.
#[inline(always)]
fn add_worths<S: Simd>(simd: S, row: &[f32], neighbours: &[f32], worths: &[f32], sums: &mut [f32]) {
    simd.vectorize(
        #[inline(always)]
        || {
            for (((&own, &other), &worth), sum) in row.iter().zip(neighbours).zip(worths).zip(sums) {
                *sum += if (other - own).abs() <= AGREE { worth } else { 0.0 };
            }
        },
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Size;
    use crate::never;

    #[test]
    fn confidence_grows_with_the_share_of_the_window_that_agrees() {
        let size = Size { width: 20, height: 12 };
        let map = |disparity| DisparityMap::new(size, vec![disparity; size.pixels()]).unwrap();
        let at = |sums: Vec<f32>, x: usize, y: usize| sums[y * size.width + x];
        let found = |left: f32, right: f32, x, y| at(confidence(&map(left), &map(right), &never).unwrap(), x, y);
        assert_eq!(found(0.0, 0.0, 10, 6), PROBABILITIES[4]);
        assert_eq!(found(0.0, 1.0, 10, 6), PROBABILITIES[2]);
        assert_eq!(found(0.0, 1.5, 10, 6), PROBABILITIES[0]);
        assert_eq!(found(DisparityMap::UNKNOWN, 0.0, 10, 6), 0.0);
        // In the corner 25 of 81 pixels lie in the image; the four left columns have no match at disparity 4.
        assert_eq!(found(0.0, 0.0, 0, 0), probability(25.0 / 81.0));
        assert_eq!(found(4.0, 4.0, 4, 6), probability(45.0 / 81.0));
        let wrong = DisparityMap::new(Size { width: 1, height: 1 }, vec![0.0]).unwrap();
        assert!(confidence(&wrong, &map(0.0), &never).is_err());
    }
}
