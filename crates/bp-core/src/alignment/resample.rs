//! Resamples an image along its columns.

use std::array;

use fearless_simd::{Level, Simd, dispatch};
use rayon::prelude::*;

use super::Alignment;
use crate::{Error, Image, Size, memory::Buffer};

/// Rows are taken in steps of 1 / `STEPS` of a pixel.
const STEPS: usize = 64;

/// This many neighbouring pixels are taken from the same rows.
const TOGETHER: usize = 32;

/// So many runs of such pixels are located at once.
const RUNS: usize = 16;

/// The sum of the weights of four rows.
const ONE: i16 = 1 << 7;

/// Makes every sum of weighted values positive, so that it fits 16 bits.
const LIFT: u16 = 64;

/// The weights of four rows. Negative ones wrap around, as do the sums.
type Weights = [u16; 4];

/// The image in which row y at column x is the cubic interpolation (Keys 1981) of row `y + rows_at(x, y)`. Border rows are
/// repeated outward.
pub(super) fn resampled(image: &Image, alignment: &Alignment) -> Result<Image, Error> {
    let Size { width, height } = image.size();
    if image.is_grey() {
        let greys = resampled_rows(image.size(), alignment, |y| image.greys_near(y).as_chunks::<1>().0)?;
        return Image::of_greys(width, height, greys);
    }
    let colours = resampled_rows(image.size(), alignment, |y| image.colours_near(y).unwrap_or_default())?;
    Image::of_colours(width, height, colours)
}

fn resampled_rows<'a, const CHANNELS: usize>(
    size: Size,
    alignment: &'a Alignment,
    row_near: impl Fn(isize) -> &'a [[u8; CHANNELS]] + Sync,
) -> Result<Buffer<[u8; CHANNELS]>, Error> {
    let (level, weights) = (Level::new(), array::from_fn(whole_weights));
    let resampling = Resampling { alignment, weights, row_near };
    let mut pixels = Buffer::filled("an aligned image", size.pixels(), [0; CHANNELS])?;
    pixels.par_chunks_exact_mut(size.width).enumerate().for_each(|(y, row)| {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || resampling.write_row(y, row),
        ));
    });
    Ok(pixels)
}

struct Resampling<'a, R> {
    alignment: &'a Alignment,
    weights: [Weights; STEPS],
    /// The pixels of a row, which may lie outside the image.
    row_near: R,
}

impl<'a, R> Resampling<'a, R> {
    #[inline(always)]
    fn write_row<const CHANNELS: usize>(&self, y: usize, row: &mut [[u8; CHANNELS]])
    where
        R: Fn(isize) -> &'a [[u8; CHANNELS]],
    {
        for (part, row) in row.chunks_mut(RUNS * TOGETHER).enumerate() {
            let first = part * RUNS * TOGETHER;
            for ((run, out), step) in row.chunks_mut(TOGETHER).enumerate().zip(self.steps(first, y)) {
                let (x, step) = (first + run * TOGETHER, step as isize);
                let top = y as isize + step.div_euclid(STEPS as isize) - 1;
                let rows = [0, 1, 2, 3].map(
                    #[inline(always)]
                    |i| (self.row_near)(top + i)[x..x + out.len()].as_flattened(),
                );
                write_mixed(rows, self.weights[step.rem_euclid(STEPS as isize) as usize], out.as_flattened_mut());
            }
        }
    }

    /// By how many steps runs of pixels move, the first of which begins at column x. This takes vectors of runs.
    #[inline(always)]
    fn steps(&self, x: usize, y: usize) -> [f64; RUNS] {
        array::from_fn(
            #[inline(always)]
            |run| {
                let middle = x + run * TOGETHER + TOGETHER / 2;
                (STEPS as f64 * self.alignment.rows_at(middle as f64, y as f64) + 0.5).floor()
            },
        )
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_rows_are_copied_in_images_of_any_width() {
        for width in [1, 31, RUNS * TOGETHER + 1, 2 * RUNS * TOGETHER + 40] {
            let size = Size { width, height: 4 };
            let grey = |x: usize, y: usize| (x * x * 7 + 61 * y) as u8;
            let image = |row_of: &dyn Fn(usize) -> usize| {
                let greys: Vec<u8> = size.nodes().map(|node| grey(node.x, row_of(node.y))).collect();
                Image::from_grey(width, size.height, greys).unwrap()
            };
            for rows in [-1_isize, 0, 2] {
                let alignment = Alignment::new(size, [rows as f64, 0.0, 0.0, 0.0, 0.0, 0.0]).unwrap();
                let expected = image(&|y| y.saturating_add_signed(rows).min(size.height - 1));
                assert_eq!(resampled(&image(&|y| y), &alignment).unwrap(), expected, "{width} columns, {rows} rows");
            }
        }
    }
}
