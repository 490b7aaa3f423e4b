//! Means of similar disparities.

use std::array;

use fearless_simd::{Level, Select, Simd, SimdBase, dispatch};
use rayon::prelude::*;

use super::{IsStopped, check::AGREE, go_on};
use crate::{DisparityMap, Error};

/// How far windows reach from their centres.
const REACH: usize = 4;
const SIDE: usize = 2 * REACH + 1;

/// The fewest rows that one thread computes.
const MIN_ROWS: usize = 8;

/// Columns that are computed together.
const COLUMNS: usize = 32;

/// Those columns, and as many on both sides as windows reach.
const WIDE: usize = COLUMNS + 2 * REACH;

/// The disparities around some columns of a row; unknown outside the map.
type Near = [[f32; WIDE]; SIDE];

/// Writes the mean of the disparities in the 9x9 window around each pixel that differ from its own by no more than [`AGREE`].
/// Both maps are `[height][width]`.
pub(super) fn write_means(
    width: usize,
    map: &[f32],
    means: &mut [f32],
    is_stopped: IsStopped<'_>,
) -> Result<(), Error> {
    let level = Level::new();
    means.par_chunks_exact_mut(width).with_min_len(MIN_ROWS).enumerate().try_for_each(|(y, means)| {
        go_on(is_stopped)?;
        let row = |dy: usize| map.get(((y + dy).checked_sub(REACH)? * width)..)?.get(..width);
        dispatch!(level, simd => row_of_means(simd, array::from_fn(row), means));
        Ok(())
    })
}

/// Writes a row. `rows` are the rows of its windows, where there are any.
#[inline(always)]
fn row_of_means<S: Simd>(simd: S, rows: [Option<&[f32]>; SIDE], means: &mut [f32]) {
    simd.vectorize(
        #[inline(always)]
        || {
            for (x, means) in (0..).step_by(COLUMNS).zip(means.chunks_mut(COLUMNS)) {
                let near = near(&rows, x);
                let vectors = means.chunks_mut(S::f32s::LEN);
                for (at, means) in (0..).step_by(S::f32s::LEN).zip(vectors) {
                    means.copy_from_slice(&means_of(simd, &near, at).as_slice()[..means.len()]);
                }
            }
        },
    );
}

/// The disparities around the columns from x on.
#[inline(always)]
fn near(rows: &[Option<&[f32]>; SIDE], x: usize) -> Near {
    let mut near = [[DisparityMap::UNKNOWN; WIDE]; SIDE];
    for (near, row) in near.iter_mut().zip(rows) {
        let Some(row) = row else { continue };
        let whole = x.checked_sub(REACH).and_then(|first| row.get(first..first + WIDE)?.try_into().ok());
        if let Some(columns) = whole {
            *near = columns;
            continue;
        }
        let (first, missing) = (x.saturating_sub(REACH), REACH.saturating_sub(x));
        let columns = &row[first..row.len().min(x + COLUMNS + REACH)];
        near[missing..missing + columns.len()].copy_from_slice(columns);
    }
    near
}

/// The means of a vector of pixels, the first of which is in this column.
#[inline(always)]
fn means_of<S: Simd>(simd: S, near: &Near, at: usize) -> S::f32s {
    let [none, one, most] = [0.0, 1.0, AGREE].map(|value| S::f32s::splat(simd, value));
    let load = |row: &[f32], from: usize| S::f32s::from_slice(simd, &row[from..from + S::f32s::LEN]);
    let own = load(&near[REACH], at + REACH);
    let (mut sums, mut counts) = (none, none);
    for row in near {
        for dx in 0..SIDE {
            let difference = load(row, at + dx) - own;
            let is_near = difference.abs().simd_le(most);
            sums += is_near.select(difference, none);
            counts += is_near.select(one, none);
        }
    }
    // An unknown pixel is near nothing, not even itself.
    own + sums / counts.max(one)
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

    #[test]
    fn vectors_compute_what_single_pixels_do() {
        for (width, height) in [(1, 1), (3, 12), (31, 2), (40, 9), (73, 11), (130, 5)] {
            let value = |i: usize| match i * i * 29 % 101 {
                0..5 => DisparityMap::UNKNOWN,
                noise => (i % width) as f32 * 0.07 + noise as f32 / 40.0,
            };
            let map: Vec<f32> = (0..width * height).map(value).collect();
            let mut means = vec![0.0; map.len()];
            write_means(width, &map, &mut means, &never).unwrap();
            let expected: Vec<f32> = (0..map.len()).map(|at| mean(width, &map, at)).collect();
            assert_eq!(means, expected, "{width}x{height}");
        }
    }
}
