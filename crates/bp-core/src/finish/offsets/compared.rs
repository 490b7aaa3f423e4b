//! Grey values between pixels, and where disparities lead.

use fearless_simd::{Select, Simd, SimdBase, SimdCvtTruncate, SimdFloat, f32x8, i16x8, i32x8};

use super::{MIDDLE, STEPS, TRIED};
use crate::finish::variances::LANES;

/// The grey value of a whole pixel, in the units of [`interpolate`].
pub(super) const UNIT: i16 = 8;

/// Writes where the tried disparities of every pixel of a row begin in the right image's row in steps; -1 if one of them
/// lies outside. `first` has columns up to a multiple of [`LANES`].
#[inline(always)]
pub(super) fn first_steps<S: Simd>(simd: S, disparities: &[f32], first: &mut [i32]) {
    let (width, (first, _)) = (disparities.len(), first.as_chunks_mut::<LANES>());
    for (x, (first, disparities)) in first.iter_mut().zip(disparities.chunks(LANES)).enumerate() {
        let mut all = [0.0; LANES];
        all[..disparities.len()].copy_from_slice(disparities);
        *first = first_steps_from(simd, LANES * x, width, all);
    }
}

/// The first steps of the pixels from column x on.
#[inline(always)]
fn first_steps_from<S: Simd>(simd: S, x: usize, width: usize, disparities: [f32; LANES]) -> [i32; LANES] {
    // Disparities that lead out of any image, and unknown ones, stay beyond all steps of a row.
    const BEYOND: f32 = (1 << 29) as f32;
    let nearest = (f32x8::load_array(simd, disparities) * STEPS as f32 + 0.5).floor();
    let nearest = nearest.max(f32x8::splat(simd, -BEYOND)).min(f32x8::splat(simd, BEYOND));
    let columns = i32x8::from_fn(simd, |lane| (STEPS * (x + lane)) as i32 - MIDDLE as i32);
    let at = columns - i32x8::truncate_from(nearest);
    let [none, last] = [-1, (STEPS * (width - 1) + 1) as i32 - TRIED as i32].map(|value| i32x8::splat(simd, value));
    let inside = at.simd_gt(none) & at.simd_le(last);
    inside.select(at, none).into()
}

/// The grey values of some pixels of the left image less those of the right one at their tried disparities, `[tried][lane]`; 0
/// where there is no first step. At least [`LANES`] steps follow each first one.
#[inline(always)]
pub(super) fn differences<S: Simd>(simd: S, left: &[i16], first: &[i32; LANES], right: &[i16]) -> [i16x8<S>; TRIED] {
    let left = i16x8::from_slice(simd, left);
    // Consecutive steps of each pixel, `[lane][step]`.
    let mut steps = [left; LANES];
    let last = right.len() - LANES;
    for (steps, &first) in steps.iter_mut().zip(first) {
        // Without a first step, any will do. The compiler drops the bounds checks after this.
        let first = (first as u32 as usize).min(last);
        *steps = i16x8::from_slice(simd, &right[first..first + LANES]);
    }
    // Each round interleaves the first half of the rows with the second. Three make columns of rows.
    for _ in 0..LANES.ilog2() {
        let mut interleaved = steps;
        for row in 0..LANES / 2 {
            let (low, high) = steps[row].interleave(steps[row + LANES / 2]);
            (interleaved[2 * row], interleaved[2 * row + 1]) = (low, high);
        }
        steps = interleaved;
    }
    let exists = i16x8::from_fn(simd, |lane| if first[lane] < 0 { 0 } else { -1 });
    let mut differences = [left; TRIED];
    for (tried, difference) in differences.iter_mut().enumerate() {
        // A larger disparity lies farther left.
        *difference = (left - steps[TRIED - 1 - tried]) & exists;
    }
    differences
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
