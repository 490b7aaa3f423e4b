//! Means of similar disparities.

use std::{array, ops::Range};

use fearless_simd::{Level, Select, Simd, SimdBase, dispatch};
use rayon::prelude::*;

use super::{IsStopped, check::AGREE, go_on};
use crate::{DisparityMap, Error, memory};

/// How far windows reach from their centres.
const REACH: usize = 4;
const SIDE: usize = 2 * REACH + 1;

/// Rows that one thread computes together.
const ROWS: usize = 48;

/// The most lanes of a vector. Rows have room for whole vectors.
const MOST_LANES: usize = 32;

/// Whole disparities within this distance from 0 are computed as such.
const MOST_WHOLE: f32 = 8192.0;

/// Writes the mean of the disparities in the 9x9 window around each pixel that differ from its own by no more than [`AGREE`].
/// Both maps are `[height][width]`.
///
/// Whole disparities, which are those of labels, are added up as integers. That gives the same means in less time, because sums
/// of whole numbers are exact.
pub(super) fn write_means(
    width: usize,
    map: &[f32],
    means: &mut [f32],
    is_stopped: IsStopped<'_>,
) -> Result<(), Error> {
    let is_whole = |&value: &f32| value == DisparityMap::UNKNOWN || value.abs() <= MOST_WHOLE && value.trunc() == value;
    let all_whole = map.par_chunks(ROWS * width).all(|values| values.iter().all(is_whole));
    let parts = means.par_chunks_mut(ROWS * width).enumerate();
    parts.map(|(index, means)| (ROWS * index..ROWS * index + means.len() / width, means)).try_for_each(
        |(rows, means)| {
            if all_whole {
                write_rows::<u16>(map, rows, means, is_stopped)
            } else {
                write_rows::<f32>(map, rows, means, is_stopped)
            }
        },
    )
}

/// The values of a row with unknown pixels around it.
fn wide(width: usize) -> usize {
    width.next_multiple_of(MOST_LANES) + 2 * REACH
}

fn write_rows<T: Value>(
    map: &[f32],
    rows: Range<usize>,
    means: &mut [f32],
    is_stopped: IsStopped<'_>,
) -> Result<(), Error> {
    let (width, level) = (means.len() / rows.len(), Level::new());
    let row_of = |y: usize| map.get(y * width..).and_then(|rows| rows.get(..width));
    let mut windows = Windows::<T>::new(width)?;
    for coming in rows.start..rows.start + 2 * REACH {
        dispatch!(level, simd => windows.enter(simd, coming, coming.checked_sub(REACH).and_then(row_of)));
    }
    for (y, means) in rows.zip(means.chunks_exact_mut(width)) {
        go_on(is_stopped)?;
        dispatch!(level, simd => windows.enter(simd, y + 2 * REACH, row_of(y + REACH)));
        dispatch!(level, simd => windows.write(simd, y, &map[y * width..][..width], means));
    }
    Ok(())
}

/// The rows of the windows around the pixels of a row.
struct Windows<T> {
    /// `[row mod 9][column]`, with [`REACH`] more columns on both sides.
    values: Vec<T>,
    wide: usize,
}

impl<T: Value> Windows<T> {
    fn new(width: usize) -> Result<Self, Error> {
        let wide = wide(width);
        Ok(Self { values: memory::filled("rows of a map", SIDE * wide, T::UNKNOWN)?, wide })
    }

    /// Takes in a row; rows outside the map are unknown.
    #[inline(always)]
    fn enter<S: Simd>(&mut self, simd: S, coming: usize, row: Option<&[f32]>) {
        let values = &mut self.values[(coming % SIDE) * self.wide..][..self.wide];
        simd.vectorize(
            #[inline(always)]
            || match row {
                Some(row) => {
                    values[REACH..REACH + row.len()].iter_mut().zip(row).for_each(|(value, &of)| *value = T::of(of));
                }
                None => values.fill(T::UNKNOWN),
            },
        );
    }

    /// Writes the means of row y, whose disparities are `own`.
    #[inline(always)]
    fn write<S: Simd>(&self, simd: S, y: usize, own: &[f32], means: &mut [f32]) {
        let rows: [&[T]; SIDE] = array::from_fn(|dy| &self.values[((y + dy) % SIDE) * self.wide..][..self.wide]);
        simd.vectorize(
            #[inline(always)]
            || T::write_means(simd, &rows, own, means),
        );
    }
}

/// A disparity as it is added up.
trait Value: Copy + Send + Sync + 'static {
    const UNKNOWN: Self;

    fn of(disparity: f32) -> Self;

    /// Writes the means of the row in the middle, whose disparities are `own`.
    fn write_means<S: Simd>(simd: S, rows: &[&[Self]; SIDE], own: &[f32], means: &mut [f32]);
}

impl Value for f32 {
    const UNKNOWN: Self = DisparityMap::UNKNOWN;

    #[inline(always)]
    fn of(disparity: f32) -> Self {
        disparity
    }

    #[inline(always)]
    fn write_means<S: Simd>(simd: S, rows: &[&[Self]; SIDE], _: &[f32], means: &mut [f32]) {
        let [none, one, most] = [0.0, 1.0, AGREE].map(|value| S::f32s::splat(simd, value));
        let load = |row: &[f32], from: usize| S::f32s::from_slice(simd, &row[from..from + S::f32s::LEN]);
        for (at, means) in (0..).step_by(S::f32s::LEN).zip(means.chunks_mut(S::f32s::LEN)) {
            let own = load(rows[REACH], at + REACH);
            let (mut sums, mut counts) = (none, none);
            for row in rows {
                for dx in 0..SIDE {
                    let difference = load(row, at + dx) - own;
                    let is_near = difference.abs().simd_le(most);
                    sums += is_near.select(difference, none);
                    counts += is_near.select(one, none);
                }
            }
            // An unknown pixel is near nothing, not even itself.
            means.copy_from_slice(&(own + sums / counts.max(one)).as_slice()[..means.len()]);
        }
    }
}

/// Whole disparities. Negative ones wrap, and so do differences.
impl Value for u16 {
    const UNKNOWN: Self = i16::MAX as u16;

    #[inline(always)]
    fn of(disparity: f32) -> Self {
        if disparity == DisparityMap::UNKNOWN { Self::UNKNOWN } else { disparity as i16 as u16 }
    }

    #[inline(always)]
    fn write_means<S: Simd>(simd: S, rows: &[&[Self]; SIDE], own: &[f32], means: &mut [f32]) {
        const WHOLE: u16 = AGREE as u16;
        let [none, one, most] = [0, 1, 2 * WHOLE].map(|value| S::u16s::splat(simd, value));
        let load = |row: &[u16], from: usize| S::u16s::from_slice(simd, &row[from..from + S::u16s::LEN]);
        let parts = means.chunks_mut(S::u16s::LEN).zip(own.chunks(S::u16s::LEN));
        for (at, (means, own)) in (0..).step_by(S::u16s::LEN).zip(parts) {
            let least = load(rows[REACH], at + REACH) - S::u16s::splat(simd, WHOLE);
            let (mut sums, mut counts) = (none, none);
            for row in rows {
                for dx in 0..SIDE {
                    let above = load(row, at + dx) - least;
                    let is_near = above.simd_le(most);
                    sums += is_near.select(above, none);
                    counts += is_near.select(one, none);
                }
            }
            let counted = sums.as_slice().iter().zip(counts.as_slice());
            for ((mean, own), (&sum, &count)) in means.iter_mut().zip(own).zip(counted) {
                *mean = own + f32::from(sum as i16 - AGREE as i16 * count as i16) / f32::from(count);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{super::never, *};

    /// The mean of one pixel, in the same order of additions.
    fn mean(width: usize, map: &[f32], at: usize) -> f32 {
        let (x, y) = (at % width, at / width);
        let (mut sum, mut count) = (0.0, 0.0);
        for (row, column) in (y..y + SIDE).flat_map(|row| (x..x + SIDE).map(move |column| (row, column))) {
            let (Some(row), Some(column)) = (row.checked_sub(REACH), column.checked_sub(REACH)) else { continue };
            let near = map.get(row * width + column).filter(|_| column < width).map(|value| value - map[at]);
            if let Some(difference) = near.filter(|difference| difference.abs() <= AGREE) {
                (sum, count) = (sum + difference, count + 1.0);
            }
        }
        if count > 0.0 { map[at] + sum / count } else { map[at] }
    }

    fn assert_means(width: usize, map: &[f32]) {
        let mut means = vec![0.0; map.len()];
        write_means(width, map, &mut means, &never).unwrap();
        let expected: Vec<f32> = (0..map.len()).map(|at| mean(width, map, at)).collect();
        assert_eq!(means, expected, "{width}x{}", map.len() / width);
    }

    #[test]
    fn vectors_compute_what_single_pixels_do() {
        for (width, height) in [(1, 1), (3, 12), (31, 2), (40, 9), (73, 11), (130, 5), (9, 2 * ROWS + 1)] {
            let value = |i: usize, whole: bool| match i * i * 29 % 101 {
                0..5 => DisparityMap::UNKNOWN,
                noise if whole => (i % width / 7) as f32 - 3.0 + (noise / 40) as f32,
                noise => (i % width) as f32 * 0.07 + noise as f32 / 40.0,
            };
            for whole in [false, true] {
                assert_means(width, &(0..width * height).map(|i| value(i, whole)).collect::<Vec<_>>());
            }
        }
        // The largest whole disparities that are added up as such, and larger ones.
        for most in [MOST_WHOLE, 2.0 * MOST_WHOLE, f32::MAX] {
            assert_means(5, &[most, most - 1.0, -most, DisparityMap::UNKNOWN, 1.0 - most]);
        }
    }
}
