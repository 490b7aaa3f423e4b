//! Means of similar disparities.

use std::array;

use fearless_simd::{Level, Select, Simd, SimdBase, dispatch};
use rayon::prelude::*;

use super::{
    IsStopped,
    check::AGREE,
    go_on,
    window::{Frame, Framed},
};
use crate::{DisparityMap, Error, memory};

/// How far windows reach from their centres.
const REACH: usize = 4;
const SIDE: usize = 2 * REACH + 1;

/// Columns that are computed together.
const COLUMNS: usize = 32;

/// Replaces every disparity by the mean of those in the 9x9 window around it that differ by no more than [`AGREE`].
pub(super) fn means(map: &DisparityMap, is_stopped: IsStopped<'_>) -> Result<DisparityMap, Error> {
    let (size, level) = (map.size(), Level::new());
    let framed = Framed::new(size, map.values(), REACH, Frame::Unknown)?;
    let mut means = memory::filled("a map", size.pixels(), 0.0)?;
    let rows = means.par_chunks_exact_mut(size.width).enumerate();
    rows.try_for_each(|(y, means)| {
        go_on(is_stopped)?;
        let rows = array::from_fn(|dy| framed.whole_row(y + dy));
        dispatch!(level, simd => write_means(simd, rows, means));
        Ok(())
    })?;
    DisparityMap::new(size, means)
}

/// Writes the means of a row. `rows` are the rows of its windows, with a frame.
#[inline(always)]
fn write_means<S: Simd>(simd: S, rows: [&[f32]; SIDE], means: &mut [f32]) {
    simd.vectorize(
        #[inline(always)]
        || {
            for (x, means) in means.chunks_mut(COLUMNS).enumerate() {
                let mut near = [[f32::INFINITY; COLUMNS + 2 * REACH]; SIDE];
                for (near, row) in near.iter_mut().zip(rows) {
                    let columns = &row[x * COLUMNS..row.len().min((x + 1) * COLUMNS + 2 * REACH)];
                    near[..columns.len()].copy_from_slice(columns);
                }
                for (at, means) in means.chunks_mut(2 * S::f32s::LEN).enumerate() {
                    let at = 2 * S::f32s::LEN * at;
                    let found = [means_of(simd, &near, at), means_of(simd, &near, at + S::f32s::LEN)];
                    for (means, found) in means.chunks_mut(S::f32s::LEN).zip(found) {
                        means.copy_from_slice(&found.as_slice()[..means.len()]);
                    }
                }
            }
        },
    );
}

/// The means of a vector of pixels, the first of which is in this column.
#[inline(always)]
fn means_of<S: Simd>(simd: S, near: &[[f32; COLUMNS + 2 * REACH]; SIDE], at: usize) -> S::f32s {
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
