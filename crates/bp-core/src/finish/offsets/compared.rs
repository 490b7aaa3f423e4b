//! Grey values between pixels, and where disparities lead.

use super::{MIDDLE, STEPS, TRIED};

/// The grey value of a whole pixel, in the units of [`interpolate`].
pub(super) const UNIT: i16 = 8;

/// Writes where the tried disparities of every pixel of a row begin in the right image's row in steps; -1 if one of them
/// lies outside.
#[inline(always)]
pub(super) fn first_steps(disparities: &[f32], first: &mut [i32]) {
    let last = (STEPS * (disparities.len() - 1) + 1) as i32 - TRIED as i32;
    for (x, (first, &disparity)) in first.iter_mut().zip(disparities).enumerate() {
        let at = (STEPS * x) as i32 - MIDDLE as i32 - nearest_step(disparity);
        *first = if at >= 0 && at <= last { at } else { -1 };
    }
}

/// A disparity in steps, rounded. Those that lead out of any image, and unknown ones, stay beyond all steps of a row.
#[inline(always)]
fn nearest_step(disparity: f32) -> i32 {
    const BEYOND: f32 = (1 << 29) as f32;
    (STEPS as f32 * disparity + 0.5).floor().clamp(-BEYOND, BEYOND) as i32
}

/// Writes the grey values of a row in steps, in [`UNIT`]s rounded up. The borders are repeated outward.
#[inline(always)]
pub(super) fn interpolate(greys: &[u8], steps: &mut [i16]) {
    const WEIGHTS: [[i32; 4]; STEPS] = [[0, 128, 0, 0], [-9, 111, 29, -3], [-8, 72, 72, -8], [-3, 29, 111, -9]];
    const ROUND: i32 = 128 / UNIT as i32;
    let at = |x: usize| i32::from(greys[x.min(greys.len() - 1)]);
    let mut near = [at(0), at(0), at(1), at(2)];
    for (x, steps) in steps.chunks_exact_mut(STEPS).enumerate() {
        for (step, weights) in steps.iter_mut().zip(WEIGHTS) {
            let sum: i32 = weights.iter().zip(near).map(|(weight, near)| weight * near).sum();
            *step = ((sum + ROUND - 1) >> ROUND.ilog2()) as i16;
        }
        near = [near[1], near[2], near[3], at(x + 3)];
    }
}
