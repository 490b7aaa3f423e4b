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

/// Disparities within this distance from 0 are added up in [`PARTS`] of a pixel.
const MOST: f32 = 1000.0;
const PARTS: i16 = 32;

/// Writes the mean of the disparities in the 9x9 window around each pixel that differ from its own by no more than [`AGREE`].
/// Both maps are `[height][width]`.
///
/// Disparities up to [`MOST`] are rounded to 1/32 px and added up as integers, which takes a third less time. For whole disparities,
/// which are those of labels, that changes nothing.
pub(super) fn write_means(
    width: usize,
    map: &[f32],
    means: &mut [f32],
    is_stopped: IsStopped<'_>,
) -> Result<(), Error> {
    let is_small = |&value: &f32| value == DisparityMap::UNKNOWN || value.abs() <= MOST;
    let all_small = map.par_chunks(ROWS * width).all(|values| values.iter().all(is_small));
    let parts = means.par_chunks_mut(ROWS * width).enumerate();
    parts.map(|(index, means)| (ROWS * index..ROWS * index + means.len() / width, means)).try_for_each(
        |(rows, means)| {
            if all_small {
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

/// A disparity in [`PARTS`] of a pixel. Negative ones wrap, and so do differences.
impl Value for u16 {
    const UNKNOWN: Self = i16::MAX as u16;

    #[inline(always)]
    fn of(disparity: f32) -> Self {
        if disparity == DisparityMap::UNKNOWN { Self::UNKNOWN } else { rounded(disparity) as i16 as u16 }
    }

    #[inline(always)]
    fn write_means<S: Simd>(simd: S, rows: &[&[Self]; SIDE], own: &[f32], means: &mut [f32]) {
        const NEAR: u16 = AGREE as u16 * PARTS as u16;
        let [none, one, most] = [0, 1, 2 * NEAR].map(|value| S::u16s::splat(simd, value));
        let load = |row: &[u16], from: usize| S::u16s::from_slice(simd, &row[from..from + S::u16s::LEN]);
        let parts = means.chunks_mut(S::u16s::LEN).zip(own.chunks(S::u16s::LEN));
        for (at, (means, own)) in (0..).step_by(S::u16s::LEN).zip(parts) {
            let least = load(rows[REACH], at + REACH) - S::u16s::splat(simd, NEAR);
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
            for ((mean, &own), (&sum, &count)) in means.iter_mut().zip(own).zip(counted) {
                let parts = f32::from(sum as i16 - NEAR as i16 * count as i16) / f32::from(count);
                *mean = (rounded(own) + parts) / f32::from(PARTS);
            }
        }
    }
}

/// A disparity in [`PARTS`] of a pixel.
#[inline(always)]
fn rounded(disparity: f32) -> f32 {
    (disparity * f32::from(PARTS)).round_ties_even()
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

    /// The means, and those of single pixels.
    fn both(width: usize, map: &[f32]) -> [Vec<f32>; 2] {
        let mut means = vec![0.0; map.len()];
        write_means(width, map, &mut means, &never).unwrap();
        [means, (0..map.len()).map(|at| mean(width, map, at)).collect()]
    }

    fn assert_means(width: usize, map: &[f32]) {
        let [means, expected] = both(width, map);
        assert_eq!(means, expected, "{width}x{}", map.len() / width);
    }

    #[test]
    fn vectors_compute_what_single_pixels_do() {
        for (width, height) in [(1, 1), (3, 12), (31, 2), (40, 9), (73, 11), (130, 5), (9, 2 * ROWS + 1)] {
            let value = |i: usize, parts: f32| match i * i * 29 % 101 {
                0..5 => DisparityMap::UNKNOWN,
                noise => (((i % width) as f32 * 0.07 + noise as f32 / 40.0 - 3.0) * parts).trunc() / parts,
            };
            for parts in [1.0, 8.0] {
                assert_means(width, &(0..width * height).map(|i| value(i, parts)).collect::<Vec<_>>());
            }
            // One disparity beyond those that are added up in parts: they are as exact as `f32`.
            let far = (0..width * height).map(|i| if i == 0 { 2.0 * MOST } else { value(i, 1000.0) });
            assert_means(width, &far.collect::<Vec<_>>());
        }
        for most in [MOST, 2.0 * MOST, f32::MAX] {
            assert_means(5, &[most, most - 1.0, -most, DisparityMap::UNKNOWN, 1.0 - most]);
        }
    }

    #[test]
    fn means_in_parts_are_hardly_less_exact() {
        let value = |i: usize| (i % 97) as f32 * 0.0193 + (i * i * 29 % 101) as f32 / 400.0;
        let [means, exact] = both(97, &(0..97 * 40).map(value).collect::<Vec<_>>());
        let squares: f32 = means.iter().zip(&exact).map(|(mean, exact)| (mean - exact).powi(2)).sum();
        assert!((squares / means.len() as f32).sqrt() < 0.004);
    }
}
