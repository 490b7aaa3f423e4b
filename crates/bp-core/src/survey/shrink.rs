//! Smaller copies of the images.

use fearless_simd::{Level, Simd, dispatch};
use rayon::prelude::*;

use crate::{Error, Image, Size, StereoPair, memory::Buffer};

/// The longest side of the shrunk images in pixels. Disparities of up to half of it, in both directions, fit 8 bits.
pub const LONGEST_SIDE: usize = 200;

/// The fewest rows that one thread computes.
const MIN_ROWS: usize = 16;

/// Columns that are added up together, unless a block has more.
const TOGETHER: usize = 2048;

/// Blocks of more columns are added up one by one. Of a row of millions of pixels, vectors of columns would add up millions of times millions.
const LONG: usize = 64;

/// So many 8-bit values add up in 16 bits.
const FIT: usize = 257;

/// A product with the inverse of the number of pixels, in units of 2^-`SHIFT`, takes less time than a quotient. For blocks of
/// up to 2^23 pixels it is as exact.
const SHIFT: u32 = 55;

/// The factor by which both sides are divided.
pub(super) fn factor(size: Size) -> usize {
    size.width.max(size.height).div_ceil(LONGEST_SIDE)
}

/// Shrinks both images in grey: a pixel is the mean of a `factor` by `factor` block. Incomplete blocks
/// at the right and bottom are left out, unless there is no complete one.
pub(super) fn shrunk(pair: &StereoPair, factor: usize) -> Result<StereoPair, Error> {
    StereoPair::new(mean_of_blocks(pair.left(), factor)?, mean_of_blocks(pair.right(), factor)?)
}

fn mean_of_blocks(image: &Image, factor: usize) -> Result<Image, Error> {
    let (Size { width, height }, level) = (image.size(), Level::new());
    let (columns, rows) = ((width / factor).max(1), (height / factor).max(1));
    let mut means = Buffer::filled("a smaller image", columns * rows, 0u8)?;
    means.par_chunks_exact_mut(columns).with_min_len(MIN_ROWS).enumerate().for_each(|(row, means)| {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || write_means(image, factor, row, means),
        ));
    });
    Image::of_greys(columns, rows, means)
}

/// Writes the means of a row of blocks.
#[inline(always)]
fn write_means(image: &Image, factor: usize, row: usize, means: &mut [u8]) {
    let Size { width, height } = image.size();
    let ys = row * factor..((row + 1) * factor).min(height);
    let count = (ys.len() * factor.min(width)) as u64;
    let inverse = inverse(count);
    let together = (TOGETHER / factor).max(1);
    for (part, means) in means.chunks_mut(together).enumerate() {
        let first = part * together * factor;
        let last = width.min(first + means.len() * factor);
        // Rows are added up first, then the columns of blocks. Both take vectors.
        let mut sums = vec![0_u16; last - first];
        let mut totals = vec![0_u32; sums.len()];
        for y in ys.clone() {
            let line = &image.greys()[y * width + first..y * width + last];
            sums.iter_mut().zip(line).for_each(|(sum, &value)| *sum += u16::from(value));
            if (y + 1 - ys.start) % FIT == 0 || y + 1 == ys.end {
                add_blocks(&mut sums, factor, &mut totals);
            }
        }
        for (mean, &total) in means.iter_mut().zip(totals.iter().step_by(factor)) {
            *mean = (((u64::from(total) + count / 2) * inverse) >> SHIFT) as u8;
        }
    }
}

/// What a number is multiplied by in place of a division by `count`.
#[inline(always)]
fn inverse(count: u64) -> u64 {
    (1 << SHIFT) / count + 1
}

/// Adds to the total of the first column of each block the block's sums, and clears them.
#[inline(always)]
fn add_blocks(sums: &mut [u16], factor: usize, totals: &mut [u32]) {
    if factor > LONG {
        let of_blocks = sums.chunks(factor).map(|block| block.iter().map(|&sum| u32::from(sum)).sum::<u32>());
        totals.iter_mut().step_by(factor).zip(of_blocks).for_each(|(total, sum)| *total += sum);
    } else {
        // For blocks that begin with any column: this takes vectors of columns.
        for column in 0..factor {
            let from = sums.get(column..).unwrap_or_default();
            totals.iter_mut().zip(from).for_each(|(total, &sum)| *total += u32::from(sum));
        }
    }
    sums.fill(0);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_rounded_as_quotients_are() {
        for count in [1_u64, 2, 3, 9, 16, 6724, (1 << 23) - 1] {
            let inverse = inverse(count);
            let sums = (0..255).flat_map(|mean| [mean * count, mean * count + count / 2, mean * count + count - 1]);
            for rounded in sums.map(|sum| sum + count / 2) {
                assert_eq!((rounded * inverse) >> SHIFT, rounded / count, "{rounded} by {count}");
            }
        }
    }

    #[test]
    fn a_pixel_is_the_mean_of_its_block() {
        let image = Image::from_grey(5, 3, [1, 2, 9, 9, 77, 3, 5, 9, 9, 77, 77, 77, 77, 77, 77]).unwrap();
        assert_eq!(mean_of_blocks(&image, 2).unwrap(), Image::from_grey(2, 1, [3, 9]).unwrap());
        assert_eq!(mean_of_blocks(&image, 1).unwrap(), image);
        let line = Image::from_grey(1, 4, [1, 3, 5, 8]).unwrap();
        assert_eq!(mean_of_blocks(&line, 2).unwrap(), Image::from_grey(1, 2, [2, 7]).unwrap());
        let wide = Image::from_grey(200, 300, (0..300 * 200).map(|i| (i % 200) as u8).collect::<Vec<_>>()).unwrap();
        assert_eq!(mean_of_blocks(&wide, 100).unwrap().greys(), [50, 150].repeat(3));
    }
}
