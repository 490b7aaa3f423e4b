//! Resamples an image along its columns.

use std::array;

use fearless_simd::{Level, Simd, dispatch};
use rayon::prelude::*;

use super::Alignment;
use crate::{Error, Image, memory};

/// Rows are taken in steps of 1 / `STEPS` of a pixel.
const STEPS: usize = 64;

/// This many neighbouring pixels are taken from the same rows.
const TOGETHER: usize = 32;

/// The sum of the weights of four rows.
const ONE: i32 = 1 << 10;

/// The weights of four rows.
type Weights = [i32; 4];

/// The image in which row y at column x is the cubic interpolation (Keys 1981) of row `y + rows_at(x, y)`. Border rows are
/// repeated outward.
pub(super) fn resampled(image: &Image, alignment: &Alignment) -> Result<Image, Error> {
    let (size, level) = (image.size(), Level::new());
    let weights: [Weights; STEPS] = array::from_fn(whole_weights);
    let mut pixels = memory::filled("an aligned image", size.pixels(), [0; 3])?;
    pixels.par_chunks_exact_mut(size.width).enumerate().for_each(|(y, row)| {
        dispatch!(level, simd => write_row(simd, image, alignment, &weights, y, row));
    });
    Image::from_rgb(size.width, size.height, pixels)
}

#[inline(always)]
fn write_row<S: Simd>(
    simd: S,
    image: &Image,
    alignment: &Alignment,
    weights: &[Weights; STEPS],
    y: usize,
    row: &mut [[u8; 3]],
) {
    simd.vectorize(
        #[inline(always)]
        || {
            for (run, out) in row.chunks_mut(TOGETHER).enumerate() {
                let first = run * TOGETHER;
                let rows = alignment.rows_at((first + TOGETHER / 2) as f64, y as f64);
                let step = (STEPS as f64 * rows + 0.5).floor() as isize;
                let top = y as isize + step.div_euclid(STEPS as isize) - 1;
                let rows = [0, 1, 2, 3].map(
                    #[inline(always)]
                    |i| image.row_near(top + i)[first..first + out.len()].as_flattened(),
                );
                write_mixed(rows, weights[step.rem_euclid(STEPS as isize) as usize], out.as_flattened_mut());
            }
        },
    );
}

#[inline(always)]
fn write_mixed([a, b, c, d]: [&[u8]; 4], weights: Weights, out: &mut [u8]) {
    for (i, out) in out.iter_mut().enumerate() {
        let sum = weights[0] * i32::from(a[i])
            + weights[1] * i32::from(b[i])
            + weights[2] * i32::from(c[i])
            + weights[3] * i32::from(d[i]);
        *out = ((sum + ONE / 2) >> 10).clamp(0, 255) as u8;
    }
}

/// The weights between two rows as whole numbers.
fn whole_weights(step: usize) -> Weights {
    let [above, _, next, below] =
        super::weights(step as f32 / STEPS as f32).map(|weight| (ONE as f32 * weight).round() as i32);
    [above, ONE - above - next - below, next, below]
}
