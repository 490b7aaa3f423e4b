//! Features: the few bytes of a pixel that a profile compares, and the cost of matching two pixels by them.

use crate::{Image, census};

/// Grey value and horizontal gradient: half the difference of the two neighbours, offset so that 128 means equal.
pub(crate) fn gradient(image: &Image, x: usize, y: usize) -> [u8; 2] {
    let beside = |dx| u16::from(image.grey_near(x as isize + dx, y as isize));
    [image.grey(x, y), ((256 + beside(1) - beside(-1)) / 2) as u8]
}

/// Grey value, and the least and greatest value within half a pixel to the left and right.
pub(crate) fn half_samples(image: &Image, x: usize, y: usize) -> [u8; 3] {
    let centre = image.grey(x, y);
    let half = |dx| (u16::from(centre) + u16::from(image.grey_near(x as isize + dx, y as isize))).div_ceil(2) as u8;
    let [left, right] = [half(-1), half(1)];
    [centre, centre.min(left).min(right), centre.max(left).max(right)]
}

/// The cost of two grey values under [`crate::Profile::Thesis`].
pub(crate) fn truncated_difference(left: u8, right: u8) -> u16 {
    (7 * difference(left, right).min(15) + 5) / 10
}

/// The cost of two colours under [`crate::Profile::Mrf`].
pub(crate) fn sum_of_differences(left: [u8; 3], right: [u8; 3]) -> u16 {
    left.into_iter().zip(right).map(|(left, right)| difference(left, right)).sum()
}

/// The census codes of the channels, and the outer code.
pub(crate) fn census_32(image: &Image, x: usize, y: usize) -> [u8; 4] {
    let [red, green, blue] = [0, 1, 2].map(|channel| census::code_of_channel(image, x, y, channel));
    [red, green, blue, census::outer_code(image, x, y)]
}

/// The number of bits in which two codes differ.
#[inline(always)]
pub(crate) fn hamming_distance<const BYTES: usize>(left: [u8; BYTES], right: [u8; BYTES]) -> u16 {
    left.into_iter().zip(right).map(|(left, right)| (left ^ right).count_ones() as u16).sum()
}

/// The cost of two features of [`gradient`] under [`crate::Profile::Gradient`].
pub(crate) fn gradient_difference([left, left_gradient]: [u8; 2], [right, right_gradient]: [u8; 2]) -> u16 {
    (3 * difference(left, right).min(20) + 35 * difference(left_gradient, right_gradient).min(4) + 5) / 10
}

/// The cost of two features of [`half_samples`] under [`crate::Profile::BirchfieldTomasi`].
pub(crate) fn sampling_insensitive_difference(left: [u8; 3], right: [u8; 3]) -> u16 {
    let outside = |[value, ..]: [u8; 3], [_, least, greatest]: [u8; 3]| {
        u16::from(value.saturating_sub(greatest).max(least.saturating_sub(value)))
    };
    (15 * outside(left, right).min(outside(right, left)).min(20) + 5) / 10
}

fn difference(left: u8, right: u8) -> u16 {
    left.abs_diff(right).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(values: &[u8]) -> Image {
        Image::from_grey(values.len(), 1, values).unwrap()
    }

    #[test]
    fn gradients_fit_a_byte_whatever_the_values() {
        let image = row(&[0, 255, 0, 10]);
        assert_eq!([0, 1, 2, 3].map(|x| gradient(&image, x, 0)), [[0, 255], [255, 128], [0, 5], [10, 133]]);
        assert_eq!(gradient(&row(&[255, 0, 0]), 0, 0), [255, 0]);
    }

    #[test]
    fn gradient_differences_are_truncated_apart_and_rounded_together() {
        let of = |grey, gradient| gradient_difference([grey, gradient], [0, 128]);
        assert_eq!([of(0, 128), of(1, 128), of(2, 128), of(255, 128)], [0, 0, 1, 6]);
        assert_eq!([of(0, 129), of(0, 127), of(3, 129), of(0, 255), of(20, 0)], [4, 4, 4, 14, 20]);
    }

    #[test]
    fn halves_are_rounded_up() {
        let image = row(&[10, 20, 21]);
        assert_eq!([0, 1, 2].map(|x| half_samples(&image, x, 0)), [[10, 10, 15], [20, 15, 21], [21, 21, 21]]);
    }

    #[test]
    fn what_half_a_pixel_explains_costs_nothing() {
        let of = sampling_insensitive_difference;
        assert_eq!(of([10, 10, 15], [15, 12, 18]), 0);
        // One value is 3 below the other's range, the other 7 above: the smaller distance counts, in either order.
        assert_eq!([of([10, 8, 13], [20, 13, 21]), of([20, 13, 21], [10, 8, 13])], [5, 5]);
        let flat = |difference| of([difference; 3], [0; 3]);
        assert_eq!([0, 1, 2, 3, 19, 20, 255].map(flat), [0, 2, 3, 5, 29, 30, 30]);
    }
}
