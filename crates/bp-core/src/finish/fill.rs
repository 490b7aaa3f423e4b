//! Filling unknown pixels.

use fearless_simd::{Level, Simd, dispatch};
use rayon::prelude::*;

use crate::DisparityMap;

/// Values that are looked through together.
const PIECE: usize = 32;

/// Fills every unknown pixel with the smaller of the nearest known disparities to its left and right, because a pixel
/// that one camera does not see belongs to the surface behind. A row without known pixels is copied from the row above
/// or, if that is unknown too, from the row below.
#[must_use]
pub fn fill(map: DisparityMap) -> DisparityMap {
    let (width, level) = (map.size().width, Level::new());
    map.replaced(|values| {
        let rows = values.par_chunks_exact_mut(width);
        let all_known = rows.map(|row| {
            dispatch!(level, simd => simd.vectorize(
                #[inline(always)]
                || fill_row(row),
            ));
            row[0].is_finite()
        });
        if !all_known.reduce(|| true, |a, b| a && b) {
            take_over_rows(values, width);
        }
    })
}

#[inline(always)]
fn fill_row(row: &mut [f32]) {
    let mut start = 0;
    while let Some(first) = first_unknown(&row[start..]).map(|first| start + first) {
        let end = row[first..].iter().position(|value| value.is_finite()).map_or(row.len(), |len| first + len);
        let left = first.checked_sub(1).map_or(DisparityMap::UNKNOWN, |x| row[x]);
        let right = row.get(end).copied().unwrap_or(DisparityMap::UNKNOWN);
        row[first..end].fill(left.min(right));
        start = end;
    }
}

/// The first unknown value. Most pieces have none, which is found for all their values at once.
#[inline(always)]
fn first_unknown(values: &[f32]) -> Option<usize> {
    let is_unknown = |value: &f32| !value.is_finite();
    let mut known = 0;
    for piece in values.as_chunks::<PIECE>().0 {
        if piece.iter().fold(false, |any, value| any | is_unknown(value)) {
            break;
        }
        known += PIECE;
    }
    values.get(known..)?.iter().position(is_unknown).map(|first| known + first)
}

/// Copies rows to rows that are unknown. At this point a row is either all known or all unknown.
fn take_over_rows(values: &mut [f32], width: usize) {
    let height = values.len() / width;
    let mut take_over = |from: usize, to: usize| {
        if !values[to * width].is_finite() {
            values.copy_within(from * width..(from + 1) * width, to * width);
        }
    };
    (1..height).for_each(|y| take_over(y - 1, y));
    (1..height).rev().for_each(|y| take_over(y, y - 1));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Size;

    const NONE: f32 = DisparityMap::UNKNOWN;

    #[test]
    fn the_smaller_neighbour_fills() {
        let mut row = [NONE, NONE, 4.0, NONE, 3.0, NONE, -2.0, NONE];
        fill_row(&mut row);
        assert_eq!(row, [4.0, 4.0, 4.0, 3.0, 3.0, -2.0, -2.0, -2.0]);
    }

    #[test]
    fn rows_without_an_answer_take_over_their_neighbours() {
        let map = DisparityMap::new(Size { width: 1, height: 5 }, vec![NONE, NONE, 1.0, NONE, 2.0]).unwrap();
        assert_eq!(fill(map).values(), [1.0, 1.0, 1.0, 1.0, 2.0]);
    }
}
