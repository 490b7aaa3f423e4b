//! The offset with the least variance.

use std::ops::RangeInclusive;

use super::{MIDDLE, STEPS, TRIED};

/// Writes disparities at the least variances, `[tried][column]`, where the tried disparities have a first step, and these
/// variances; elsewhere disparities stay, and variances are infinite.
#[inline(always)]
pub(super) fn write_best(
    variances: &[f32],
    first: &[i32],
    disparities: &[f32],
    limits: &RangeInclusive<f32>,
    refined: &mut [f32],
    least: &mut [f32],
) {
    let width = disparities.len();
    // Slices of one known length let the compiler drop the bounds checks in the loop.
    let mut rows = [&variances[..width]; TRIED];
    for (row, of_step) in rows.iter_mut().zip(variances.chunks_exact(width)) {
        *row = of_step;
    }
    let (first, refined, least) = (&first[..width], &mut refined[..width], &mut least[..width]);
    for x in 0..width {
        let (steps, variance) = best_step([rows[0][x], rows[1][x], rows[2][x], rows[3][x], rows[4][x]]);
        let nearest = (STEPS * x) as i32 - MIDDLE as i32 - first[x];
        let found = (nearest as f32 + steps) / STEPS as f32;
        let found = found.max(*limits.start()).min(*limits.end());
        (refined[x], least[x]) = if first[x] >= 0 { (found, variance) } else { (disparities[x], f32::INFINITY) };
    }
}

/// The place of the least variance, in steps from the middle one, and the least one of those that were tried.
#[inline(always)]
fn best_step(variances: [f32; TRIED]) -> (f32, f32) {
    let [a, b, c, d, e] = variances;
    // Where all offsets fit equally, as in a blank area, the disparity stays.
    let mut best = [b, c, d, 0.0];
    if b < best[1] {
        best = [a, b, c, -1.0];
    }
    if d < best[1] {
        best = [c, d, e, 1.0];
    }
    let [before, least, after, place] = best;
    let curvature = before - 2.0 * least + after;
    let fraction = ((before - after) / (2.0 * curvature)).clamp(-1.0, 1.0);
    (place + if curvature > 0.0 { fraction } else { 0.0 }, least)
}
