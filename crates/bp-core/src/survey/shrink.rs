//! Smaller copies of the images.

use rayon::prelude::*;

use crate::{Error, Image, Size, StereoPair, image::grey, memory};

/// The longest side of the shrunk images in pixels. Disparities of up to half of it, in both directions, fit 8 bits.
pub const LONGEST_SIDE: usize = 200;

/// The fewest rows that one thread computes.
const MIN_ROWS: usize = 16;

/// Columns that are added up together, unless a block has more.
const TOGETHER: usize = 2048;

/// So many 8-bit values add up in 16 bits.
const FIT: usize = 257;

/// The factor by which both sides are divided.
pub(super) fn factor(size: Size) -> usize {
    size.width.max(size.height).div_ceil(LONGEST_SIDE)
}

/// Shrinks both images to grey: a pixel is the luma of the mean colour of a `factor` by `factor` block. Incomplete blocks
/// at the right and bottom are left out, unless there is no complete one.
pub(super) fn shrunk(pair: &StereoPair, factor: usize) -> Result<StereoPair, Error> {
    StereoPair::new(mean_of_blocks(pair.left(), factor)?, mean_of_blocks(pair.right(), factor)?)
}

fn mean_of_blocks(image: &Image, factor: usize) -> Result<Image, Error> {
    let Size { width, height } = image.size();
    let (columns, rows) = ((width / factor).max(1), (height / factor).max(1));
    let mut means = memory::filled("a smaller image", columns * rows, 0u8)?;
    means.par_chunks_exact_mut(columns).with_min_len(MIN_ROWS).enumerate().for_each(|(row, means)| {
        let ys = row * factor..((row + 1) * factor).min(height);
        let count = (ys.len() * factor.min(width)) as u32;
        let together = (TOGETHER / factor).max(1);
        for (part, means) in means.chunks_mut(together).enumerate() {
            let first = part * together * factor;
            let last = width.min(first + means.len() * factor);
            let mut totals = vec![[0_u32; 3]; means.len()];
            // Rows are added up first, because that takes vectors.
            let mut sums = vec![0_u16; (last - first) * 3];
            for y in ys.clone() {
                let line = image.pixels()[y * width + first..y * width + last].as_flattened();
                sums.iter_mut().zip(line).for_each(|(sum, &value)| *sum += u16::from(value));
                if (y + 1 - ys.start) % FIT == 0 || y + 1 == ys.end {
                    add_blocks(&mut sums, factor, &mut totals);
                }
            }
            for (mean, total) in means.iter_mut().zip(totals) {
                *mean = grey(total.map(|sum| ((sum + count / 2) / count) as u8));
            }
        }
    });
    Image::from_grey(columns, rows, &means)
}

/// Adds the sums of each block's columns to its total, and clears them.
fn add_blocks(sums: &mut [u16], factor: usize, totals: &mut [[u32; 3]]) {
    for (total, block) in totals.iter_mut().zip(sums.as_chunks::<3>().0.chunks(factor)) {
        for column in block {
            total.iter_mut().zip(column).for_each(|(total, &sum)| *total += u32::from(sum));
        }
    }
    sums.fill(0);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_is_the_mean_of_its_block() {
        let image = Image::from_grey(5, 3, &[1, 2, 9, 9, 77, 3, 5, 9, 9, 77, 77, 77, 77, 77, 77]).unwrap();
        assert_eq!(mean_of_blocks(&image, 2).unwrap(), Image::from_grey(2, 1, &[3, 9]).unwrap());
        assert_eq!(mean_of_blocks(&image, 1).unwrap(), image);
        let line = Image::from_grey(1, 4, &[1, 3, 5, 8]).unwrap();
        assert_eq!(mean_of_blocks(&line, 2).unwrap(), Image::from_grey(1, 2, &[2, 7]).unwrap());
    }
}
