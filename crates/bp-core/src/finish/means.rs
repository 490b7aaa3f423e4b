//! Means of similar disparities.

use std::{array, ops::RangeInclusive};

use fearless_simd::{Bytes, Level, Select, Simd, SimdBase, SimdInt, dispatch, u8x16};
use rayon::prelude::*;

use super::{check::AGREE, rows::rows_together};
use crate::{DisparityMap, Error, IsStopped, memory::Buffer, stop::go_on};

/// How far the pixels of a window lie apart, in one pass after the other. Windows have 3x3 of them. Such windows are the
/// edge-avoiding wavelets of Dammertz et al. 2010.
pub(super) struct Spacings {
    first: &'static [usize],
    last: usize,
}

/// Before offsets are found: together means over 11x11 pixels.
pub(super) const BEFORE: Spacings = Spacings { first: &[4], last: 1 };
/// After that: over 15x15. With fewer passes than these five, more disparities are whole on slopes.
pub(super) const AFTER: Spacings = Spacings { first: &[4, 2], last: 1 };
const SIDE: usize = 3;

/// How far all passes together reach at most.
const REACH: usize = 7;

/// Unknown columns on both sides of a map.
const MARGIN: usize = 4;

/// The most lanes of a vector. Rows have room for whole vectors.
const MOST_LANES: usize = 32;

/// Disparities within this distance from 0 are added up in [`PARTS`] of a pixel.
const MOST: f32 = 1000.0;
const PARTS: f32 = 32.0;

/// Writes means of the disparities around each pixel, then means of these, and so on: a pass for each of `spacings`. Only those
/// count that differ from the one in the middle by no more than [`AGREE`]. Both maps are `[height][width]`; known
/// disparities lie within `limits`.
///
/// Disparities up to [`MOST`] are rounded to 1/32 px before each pass and added up as integers, which takes less time.
pub(super) fn write_means(
    width: usize,
    map: &[f32],
    limits: &RangeInclusive<f32>,
    spacings: &Spacings,
    means: &mut [f32],
    is_stopped: IsStopped<'_>,
) -> Result<(), Error> {
    let all_small = -MOST <= *limits.start() && *limits.end() <= MOST;
    let rows = rows_together(map.len() / width, rayon::current_num_threads());
    means.par_chunks_mut(rows * width).enumerate().try_for_each(|(index, means)| {
        if all_small {
            write_rows::<u16>(width, map, spacings, rows * index, means, is_stopped)
        } else {
            write_rows::<f32>(width, map, spacings, rows * index, means, is_stopped)
        }
    })
}

/// The temporary bytes of a thread for so many rows of this width.
pub(super) fn bytes(width: usize, rows: usize) -> u64 {
    2 * ((rows + 2 * REACH) * wide(width) * size_of::<f32>()) as u64
}

/// The columns of a row and its margins.
fn wide(width: usize) -> usize {
    width.next_multiple_of(MOST_LANES) + 2 * MARGIN
}

fn write_rows<T: Value>(
    width: usize,
    map: &[f32],
    spacings: &Spacings,
    first: usize,
    means: &mut [f32],
    is_stopped: IsStopped<'_>,
) -> Result<(), Error>
where
    f32: Mean<T>,
{
    let (height, level) = (map.len() / width, Level::new());
    let end = first + means.len() / width;
    let around = |reach: usize| first.saturating_sub(reach)..(end + reach).min(height);
    let place = |y: usize| y + REACH - first;
    let [mut before, mut after] = [Block::<T>::around(end - first, width)?, Block::around(end - first, width)?];
    let &Spacings { first: passes, last } = spacings;
    let mut reach = last + passes.iter().sum::<usize>();
    for y in around(reach) {
        dispatch!(level, simd => enter(simd, &map[y * width..][..width], before.row(place(y))));
    }
    for &spacing in passes {
        reach -= spacing;
        for y in around(reach) {
            go_on(is_stopped)?;
            let (windows, row) = (before.windows(place(y), spacing), after.row(place(y)));
            dispatch!(level, simd => T::write_means(simd, windows, spacing, row));
        }
        std::mem::swap(&mut before, &mut after);
    }
    for (y, means) in (first..).zip(means.chunks_exact_mut(width)) {
        go_on(is_stopped)?;
        let windows = before.windows(place(y), last);
        dispatch!(level, simd => T::write_means(simd, windows, last, means));
    }
    Ok(())
}

#[inline(always)]
fn enter<S: Simd, T: Value>(simd: S, row: &[f32], values: &mut [T]) {
    simd.vectorize(
        #[inline(always)]
        || values.iter_mut().zip(row).for_each(|(value, &of)| *value = T::of(of)),
    );
}

/// Rows of a map, with unknown pixels around them.
struct Block<T> {
    /// `[row][column]`, with [`MARGIN`] more columns on both sides.
    values: Buffer<T>,
    wide: usize,
}

impl<T: Value> Block<T> {
    /// So many rows, and [`REACH`] more above and below.
    fn around(rows: usize, width: usize) -> Result<Self, Error> {
        let wide = wide(width);
        Ok(Self { values: Buffer::filled("rows of a map", (rows + 2 * REACH) * wide, T::UNKNOWN)?, wide })
    }

    /// A row without its margins.
    fn row(&mut self, row: usize) -> &mut [T] {
        &mut self.values[row * self.wide + MARGIN..][..self.wide - 2 * MARGIN]
    }

    /// The rows of the windows around the pixels of a row.
    fn windows(&self, row: usize, spacing: usize) -> [&[T]; SIDE] {
        array::from_fn(|i| &self.values[(row + i * spacing - spacing) * self.wide..][..self.wide])
    }
}

/// A disparity as it is added up.
trait Value: Mean<Self> + Copy + Send + Sync + 'static {
    const UNKNOWN: Self;

    fn of(disparity: f32) -> Self;

    /// Writes the means of the windows of a row.
    fn write_means<S: Simd, M: Mean<Self>>(simd: S, rows: [&[Self]; SIDE], spacing: usize, means: &mut [M]);
}

/// The mean of a window.
trait Mean<T> {
    /// The mean of `count` values whose differences from the one in the middle add up to `sum`. `inverse` is that of [`INVERSES`].
    fn at(middle: T, sum: T, count: T, inverse: T) -> Self;
}

impl Value for f32 {
    const UNKNOWN: Self = DisparityMap::UNKNOWN;

    #[inline(always)]
    fn of(disparity: f32) -> Self {
        disparity
    }

    #[inline(always)]
    fn write_means<S: Simd, M: Mean<f32>>(simd: S, rows: [&[f32]; SIDE], spacing: usize, means: &mut [M]) {
        simd.vectorize(
            #[inline(always)]
            || {
                let [none, one, most] = [0.0, 1.0, AGREE].map(|value| S::f32s::splat(simd, value));
                let load = |row: &[f32], from: usize| S::f32s::from_slice(simd, &row[from..from + S::f32s::LEN]);
                for (at, means) in (MARGIN..).step_by(S::f32s::LEN).zip(means.chunks_mut(S::f32s::LEN)) {
                    let middle = load(rows[1], at);
                    let (mut sums, mut counts) = (none, none);
                    for row in rows {
                        for column in 0..SIDE {
                            let difference = load(row, at + column * spacing - spacing) - middle;
                            let is_near = difference.abs().simd_le(most);
                            sums += is_near.select(difference, none);
                            counts += is_near.select(one, none);
                        }
                    }
                    // An unknown pixel is near nothing, not even itself.
                    let counts = counts.max(one);
                    let sums = sums.as_slice().iter().zip(counts.as_slice());
                    for ((mean, &middle), (&sum, &count)) in means.iter_mut().zip(middle.as_slice()).zip(sums) {
                        *mean = M::at(middle, sum, count, 0.0);
                    }
                }
            },
        );
    }
}

impl Mean<f32> for f32 {
    #[inline(always)]
    fn at(middle: f32, sum: f32, count: f32, _: f32) -> Self {
        middle + sum / count
    }
}

/// The largest difference of values that are near each other, in [`PARTS`] of a pixel, and one more than their range.
const NEAR: u16 = (AGREE * PARTS) as u16;
const FAR: u16 = 2 * NEAR + 1;

/// 2^16 / (2 i) for a count of i values, rounded up. For numbers below 3600, the upper 16 bits of the product with it are the quotient
/// by 2 i.
const INVERSES: [u16; 10] = {
    let (mut inverses, mut count) = ([0; 10], 1);
    while count < inverses.len() {
        inverses[count] = (1_u32 << 15).div_ceil(count as u32) as u16;
        count += 1;
    }
    inverses
};

/// The inverses of counts, one byte after the other: vectors look up bytes.
#[inline(always)]
fn inverses<S: Simd>(simd: S, counts: S::u16s) -> S::u16s {
    let counts = counts.bitcast::<S::u8s>();
    let [low, high] = [0, 8].map(
        #[inline(always)]
        |shift| {
            let byte = |count| INVERSES.get(count).map_or(0, |inverse| (inverse >> shift) as u8);
            let table = S::u8s::block_splat(u8x16::from_fn(simd, byte));
            table.swizzle_dyn_within_blocks(counts).bitcast::<S::u16s>()
        },
    );
    low | high << 8
}

/// A disparity in [`PARTS`] of a pixel. Negative ones wrap, and so do differences.
impl Value for u16 {
    const UNKNOWN: Self = i16::MAX as u16;

    #[inline(always)]
    fn of(disparity: f32) -> Self {
        if disparity == DisparityMap::UNKNOWN { Self::UNKNOWN } else { rounded(PARTS * disparity) }
    }

    #[inline(always)]
    fn write_means<S: Simd, M: Mean<u16>>(simd: S, rows: [&[u16]; SIDE], spacing: usize, means: &mut [M]) {
        simd.vectorize(
            #[inline(always)]
            || {
                let [none, one, near, far] = [0, 1, NEAR, FAR].map(|value| S::u16s::splat(simd, value));
                // Slices of one known length let the compiler drop all bounds checks but one.
                let columns = means.len().next_multiple_of(S::u16s::LEN);
                let taps = rows.map(|row| [0, 1, 2].map(|i| &row[MARGIN - spacing + i * spacing..][..columns]));
                for (at, means) in (0..columns).step_by(S::u16s::LEN).zip(means.chunks_mut(S::u16s::LEN)) {
                    let load = |tap: &[u16]| S::u16s::from_slice(simd, &tap[at..at + S::u16s::LEN]);
                    let middle = load(taps[1][1]);
                    let least = middle - near;
                    // From 1 to FAR where it is near, otherwise 0.
                    let (mut sums, mut counts) = (none, none);
                    for row in taps {
                        for tap in row {
                            let below = far.saturating_sub(load(tap) - least);
                            sums += below;
                            counts += below.min(one);
                        }
                    }
                    let (sums, inverses) = (counts * (far - near) - sums, inverses(simd, counts));
                    let counts = counts.as_slice().iter().zip(inverses.as_slice());
                    let windows = middle.as_slice().iter().zip(sums.as_slice()).zip(counts);
                    for (mean, ((&middle, &sum), (&count, &inverse))) in means.iter_mut().zip(windows) {
                        *mean = M::at(middle, sum, count, inverse);
                    }
                }
            },
        );
    }
}

impl Mean<u16> for u16 {
    /// Rounds the mean to the nearest integer, the even one of two. A product takes less time than a quotient.
    #[inline(always)]
    fn at(middle: u16, sum: u16, count: u16, inverse: u16) -> Self {
        // Twice the sum of what the values lie above the least near one, and half a step more.
        let doubled = sum.wrapping_mul(2).wrapping_add(FAR * count);
        let quotient = ((u32::from(doubled) * u32::from(inverse)) >> 16) as u16;
        let is_tie = quotient * 2 * count == doubled;
        let rounded = quotient - (u16::from(is_tie) & quotient);
        middle.wrapping_add(rounded).wrapping_sub(NEAR)
    }
}

impl Mean<u16> for f32 {
    #[inline(always)]
    fn at(middle: u16, sum: u16, count: u16, _: u16) -> Self {
        let mean = (f32::from(middle as i16) + f32::from(sum as i16) / f32::from(count)) / PARTS;
        if middle == <u16 as Value>::UNKNOWN { DisparityMap::UNKNOWN } else { mean }
    }
}

/// The nearest integer, modulo 2^16; the even one of two. Adding this number leaves it in the lowest bits.
#[inline(always)]
fn rounded(value: f32) -> u16 {
    const INTEGERS: f32 = (3 << 22) as f32;
    (value + INTEGERS).to_bits() as u16
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{finish::rows::TOGETHER, never};

    /// The mean of one window less the disparity in its middle, in the same order of additions.
    fn offset(width: usize, map: &[f32], spacing: usize, at: usize) -> f32 {
        let (x, y) = (at % width, at / width);
        let (mut sum, mut count) = (0.0, 0.0_f32);
        let steps = |from: usize| (from..=from + 2 * spacing).step_by(spacing);
        for (row, column) in steps(y).flat_map(|row| steps(x).map(move |column| (row, column))) {
            let (Some(row), Some(column)) = (row.checked_sub(spacing), column.checked_sub(spacing)) else { continue };
            let near = map.get(row * width + column).filter(|_| column < width).map(|value| value - map[at]);
            if let Some(difference) = near.filter(|difference| difference.abs() <= AGREE) {
                (sum, count) = (sum + difference, count + 1.0);
            }
        }
        sum / count.max(1.0)
    }

    /// Pass after pass, pixel after pixel; rounded before each pass, if asked to.
    fn expected(width: usize, map: &[f32], spacings: &Spacings, is_rounded: bool) -> Vec<f32> {
        let round = |value: f32| if is_rounded { (PARTS * value).round_ties_even() / PARTS } else { value };
        let pass = |map: &[f32], spacing, round: &dyn Fn(f32) -> f32| -> Vec<f32> {
            (0..map.len()).map(|at| map[at] + round(offset(width, map, spacing, at))).collect()
        };
        let &Spacings { first: passes, last } = spacings;
        let start = map.iter().copied().map(round).collect::<Vec<_>>();
        pass(&passes.iter().fold(start, |map, &spacing| pass(&map, spacing, &round)), last, &|offset| offset)
    }

    fn means(width: usize, map: &[f32], spacings: &Spacings) -> Vec<f32> {
        let mut means = vec![0.0; map.len()];
        let known = || map.iter().copied().filter(|value| value.is_finite());
        let limits = known().fold(0.0, f32::min)..=known().fold(0.0, f32::max);
        write_means(width, map, &limits, spacings, &mut means, &never).unwrap();
        means
    }

    fn assert_means(width: usize, map: &[f32], is_rounded: bool) {
        for spacings in [BEFORE, AFTER] {
            let expected = expected(width, map, &spacings, is_rounded);
            assert_eq!(means(width, map, &spacings), expected, "{width}x{}", map.len() / width);
        }
    }

    #[test]
    fn passes_reach_as_far_as_their_windows() {
        let passes = [BEFORE, AFTER].map(|spacings| [spacings.first, &[spacings.last]].concat());
        assert_eq!(Some(REACH), passes.iter().map(|spacings| spacings.iter().sum()).max());
        assert!(passes.iter().flatten().all(|&spacing| spacing <= MARGIN));
    }

    #[test]
    #[cfg_attr(miri, ignore = "takes minutes")]
    fn vectors_compute_what_single_pixels_do() {
        for (width, height) in [(1, 1), (3, 12), (31, 2), (40, 9), (73, 11), (130, 5), (9, 2 * TOGETHER.end() + 1)] {
            let value = |i: usize| match i * i * 29 % 101 {
                0..5 => DisparityMap::UNKNOWN,
                noise => (i % width) as f32 * 0.07 + noise as f32 / 40.0 - 3.0,
            };
            assert_means(width, &(0..width * height).map(value).collect::<Vec<_>>(), true);
            // One disparity beyond those that are added up in parts: they are as exact as `f32`.
            let far = (0..width * height).map(|i| if i == 0 { 2.0 * MOST } else { value(i) });
            assert_means(width, &far.collect::<Vec<_>>(), false);
        }
        for most in [MOST, 2.0 * MOST, f32::MAX] {
            assert_means(5, &[most, most - 1.0, -most, DisparityMap::UNKNOWN, 1.0 - most], most == MOST);
        }
    }

    #[test]
    #[cfg_attr(miri, ignore = "takes minutes")]
    fn means_in_parts_are_hardly_less_exact() {
        let value = |i: usize| (i % 97) as f32 * 0.0193 + (i * i * 29 % 101) as f32 / 400.0;
        let map: Vec<f32> = (0..97 * 40).map(value).collect();
        let [means, exact] = [means(97, &map, &AFTER), expected(97, &map, &AFTER, false)];
        let squares: f32 = means.iter().zip(&exact).map(|(mean, exact)| (mean - exact).powi(2)).sum();
        assert!((squares / means.len() as f32).sqrt() < 0.006);
    }
}
