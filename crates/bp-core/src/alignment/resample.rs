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
const ONE: i16 = 1 << 7;

/// Makes every sum of weighted values positive, so that it fits 16 bits.
const LIFT: u16 = 64;

/// The weights of four rows. Negative ones wrap around, as do the sums.
type Weights = [u16; 4];

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
                write_run(image, alignment, weights, [run * TOGETHER, y], out);
            }
        },
    );
}

/// Writes some pixels from column x of row y on.
#[inline(always)]
fn write_run(
    image: &Image,
    alignment: &Alignment,
    weights: &[Weights; STEPS],
    [x, y]: [usize; 2],
    out: &mut [[u8; 3]],
) {
    let rows = alignment.rows_at((x + TOGETHER / 2) as f64, y as f64);
    let step = (STEPS as f64 * rows + 0.5).floor() as isize;
    let top = y as isize + step.div_euclid(STEPS as isize) - 1;
    let rows = [0, 1, 2, 3].map(
        #[inline(always)]
        |i| image.row_near(top + i)[x..x + out.len()].as_flattened(),
    );
    write_mixed(rows, weights[step.rem_euclid(STEPS as isize) as usize], out.as_flattened_mut());
}

#[inline(always)]
fn write_mixed([a, b, c, d]: [&[u8]; 4], weights: Weights, out: &mut [u8]) {
    for ((((out, &a), &b), &c), &d) in out.iter_mut().zip(a).zip(b).zip(c).zip(d) {
        let mut sum = LIFT * ONE as u16 + ONE as u16 / 2;
        for (weight, value) in weights.into_iter().zip([a, b, c, d]) {
            sum = sum.wrapping_add(weight.wrapping_mul(value.into()));
        }
        *out = (sum >> ONE.ilog2()).saturating_sub(LIFT).min(255) as u8;
    }
}

/// The weights between two rows as whole numbers.
fn whole_weights(step: usize) -> Weights {
    let weight = |weight: f32| (f32::from(ONE) * weight).round() as i16;
    let [above, _, next, below] = super::weights(step as f32 / STEPS as f32).map(weight);
    [above, ONE - above - next - below, next, below].map(i16::cast_unsigned)
}
