//! How far a map can be trusted.

use super::{
    IsStopped,
    check::{AGREE, difference},
    go_on,
    window::{Frame, Framed, window},
};
use crate::{DisparityMap, Error, metrics::check_size};

/// How far the window reaches from its centre.
const REACH: usize = 4;

/// The confidence of each pixel of the left map, `[height][width]`, from 0 to 1: the mean worth of the pixels in the
/// 9x9 window around it. A pixel that differs from the centre by no more than [`AGREE`] is worth 1 if its match in the
/// right map has the same disparity, and half if that differs by no more than [`AGREE`]. All other pixels, and those
/// outside the image, are worth nothing.
///
/// The measure is ours. Although it is simple, it separates correct pixels from wrong ones nearly as well as the best
/// measure that we tried (docs/algorithms.md).
///
/// # Errors
/// [`Error::WrongSize`] if the maps differ in size, [`Error::OutOfMemory`], [`Error::Stopped`].
pub fn confidence(left: &DisparityMap, right: &DisparityMap, is_stopped: IsStopped<'_>) -> Result<Vec<f32>, Error> {
    check_size("the right image's map", right.size(), left.size())?;
    let size = left.size();
    let rows = left.values().chunks_exact(size.width).zip(right.values().chunks_exact(size.width));
    let worths: Vec<f32> =
        rows.flat_map(|(left, right)| left.iter().enumerate().map(|(x, &d)| worth(x, d, right))).collect();
    let disparities = Framed::new(size, left.values(), REACH, Frame::Unknown)?;
    let worths = Framed::new(size, &worths, REACH, Frame::Unknown)?;
    let mut sums = vec![0.0; size.pixels()];
    for (y, (sums, row)) in sums.chunks_exact_mut(size.width).zip(left.values().chunks_exact(size.width)).enumerate() {
        go_on(is_stopped)?;
        for (dx, dy) in window(REACH) {
            add_worth(row, disparities.row(y, dx, dy), worths.row(y, dx, dy), sums);
        }
        sums.iter_mut().for_each(|sum| *sum /= window(REACH).count() as f32);
    }
    Ok(sums)
}

/// The worth of a single pixel.
fn worth(x: usize, disparity: f32, right: &[f32]) -> f32 {
    match difference(x, disparity, right) {
        Some(0.0) => 1.0,
        Some(difference) if difference <= AGREE => 0.5,
        _ => 0.0,
    }
}

/// Adds the worth of neighbours with a similar disparity.
fn add_worth(row: &[f32], neighbours: &[f32], worths: &[f32], sums: &mut [f32]) {
    for (((&own, &other), &worth), sum) in row.iter().zip(neighbours).zip(worths).zip(sums) {
        *sum += if (other - own).abs() <= AGREE { worth } else { 0.0 };
    }
}

#[cfg(test)]
mod tests {
    use super::{super::never, *};
    use crate::Size;

    #[test]
    fn confidence_is_the_share_of_the_window_that_agrees() {
        let size = Size { width: 20, height: 12 };
        let map = |disparity| DisparityMap::new(size, vec![disparity; size.pixels()]).unwrap();
        let at = |sums: Vec<f32>, x: usize, y: usize| sums[y * size.width + x];
        assert_eq!(at(confidence(&map(0.0), &map(0.0), &never).unwrap(), 10, 6), 1.0);
        assert_eq!(at(confidence(&map(0.0), &map(1.0), &never).unwrap(), 10, 6), 0.5);
        assert_eq!(at(confidence(&map(0.0), &map(1.5), &never).unwrap(), 10, 6), 0.0);
        assert_eq!(at(confidence(&map(DisparityMap::UNKNOWN), &map(0.0), &never).unwrap(), 10, 6), 0.0);
        // In the corner 25 of 81 pixels lie in the image; the four left columns have no match at disparity 4.
        assert_eq!(at(confidence(&map(0.0), &map(0.0), &never).unwrap(), 0, 0), 25.0 / 81.0);
        assert_eq!(at(confidence(&map(4.0), &map(4.0), &never).unwrap(), 4, 6), 45.0 / 81.0);
        let wrong = DisparityMap::new(Size { width: 1, height: 1 }, vec![0.0]).unwrap();
        assert!(confidence(&wrong, &map(0.0), &never).is_err());
    }
}
