//! Sub-pixel refinement.

use super::{
    check::AGREE,
    window::{Frame, Framed},
};
use crate::{DisparityMap, Error};

/// How far the window reaches from its centre.
const REACH: usize = 4;

/// Replaces every disparity by the mean of those in the 9x9 window around it that differ by no more than [`AGREE`]. The
/// labels of a slanted surface form steps; their mean follows the slope.
///
/// The method is ours. It halves the number of errors above 0.5 px if the ground truth is finer than whole pixels.
/// Fitting a parabola to the matching costs did not (docs/algorithms.md).
///
/// # Errors
/// [`Error::OutOfMemory`].
pub fn subpixel(map: &DisparityMap) -> Result<DisparityMap, Error> {
    let size = map.size();
    let framed = Framed::new(size, map.values(), REACH, Frame::Unknown)?;
    let mut means = Vec::with_capacity(size.pixels());
    let (mut sums, mut counts) = (vec![0.0; size.width], vec![0.0; size.width]);
    for (y, row) in map.values().chunks_exact(size.width).enumerate() {
        sums.fill(0.0);
        counts.fill(0.0);
        for (dx, dy) in window() {
            add_near(row, framed.row(y, dx, dy), &mut sums, &mut counts);
        }
        // An unknown pixel is near nothing, not even itself.
        let mean = |((&d, sum), count): ((&f32, &f32), &f32)| if *count > 0.0 { d + sum / count } else { d };
        means.extend(row.iter().zip(&sums).zip(&counts).map(mean));
    }
    DisparityMap::new(size, means)
}

/// The position of each pixel of the window in its frame.
pub(super) fn window() -> impl Iterator<Item = (usize, usize)> {
    (0..=2 * REACH).flat_map(|dy| (0..=2 * REACH).map(move |dx| (dx, dy)))
}

/// Adds the differences to neighbours with a similar disparity, and counts these neighbours.
fn add_near(row: &[f32], neighbours: &[f32], sums: &mut [f32], counts: &mut [f32]) {
    for (((&own, &other), sum), count) in row.iter().zip(neighbours).zip(sums).zip(counts) {
        let difference = other - own;
        let near = difference.abs() <= AGREE;
        *sum += if near { difference } else { 0.0 };
        *count += if near { 1.0 } else { 0.0 };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Size;

    #[test]
    fn a_staircase_becomes_a_slope() {
        let size = Size { width: 64, height: 9 };
        let slope = |x: usize| 10.0 + 0.25 * x as f32;
        let steps = (0..size.pixels()).map(|i| slope(i % size.width).round()).collect();
        let map = subpixel(&DisparityMap::new(size, steps).unwrap()).unwrap();
        let worst = (8..56).map(|x| (map.at(x, 4).unwrap() - slope(x)).abs()).fold(0.0, f32::max);
        assert!(worst <= 0.25, "{worst}");
    }

    #[test]
    fn edges_and_unknown_pixels_stay() {
        let values = vec![3.0, 3.0, DisparityMap::UNKNOWN, 8.0, 8.0];
        let map = DisparityMap::new(Size { width: 5, height: 1 }, values).unwrap();
        assert_eq!(subpixel(&map).unwrap(), map);
    }
}
