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

/// Writes the grey values of a row in steps, in [`UNIT`]s rounded up. `greys` has one more column on the left and two on the right.
#[inline(always)]
pub(super) fn interpolate(greys: &[u8], steps: &mut [i16]) {
    const WEIGHTS: [[i32; 4]; STEPS] = [[0, 128, 0, 0], [-9, 111, 29, -3], [-8, 72, 72, -8], [-3, 29, 111, -9]];
    const ROUND: i32 = 128 / UNIT as i32;
    let (steps, _) = steps.as_chunks_mut::<STEPS>();
    let near = [0, 1, 2, 3].map(
        #[inline(always)]
        |column: usize| &greys[column..column + steps.len()],
    );
    for (x, steps) in steps.iter_mut().enumerate() {
        let near = [near[0][x], near[1][x], near[2][x], near[3][x]].map(i32::from);
        for step in 0..STEPS {
            let [a, b, c, d] = WEIGHTS[step];
            let sum = a * near[0] + b * near[1] + c * near[2] + d * near[3];
            steps[step] = ((sum + ROUND - 1) >> ROUND.ilog2()) as i16;
        }
    }
}
