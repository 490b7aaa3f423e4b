//! Smaller copies of the images.

use super::LONGEST_SIDE;
use crate::{Error, Image, Size, StereoPair, memory};

/// By what both sides are divided.
pub(super) fn factor(size: Size) -> usize {
    size.width.max(size.height).div_ceil(LONGEST_SIDE)
}

/// Both images in grey, with the mean of each `factor` by `factor` block as a pixel. What fills no block is left out,
/// unless there is nothing else.
pub(super) fn shrunk(pair: &StereoPair, factor: usize) -> Result<StereoPair, Error> {
    StereoPair::new(mean_of_blocks(pair.left(), factor)?, mean_of_blocks(pair.right(), factor)?)
}

fn mean_of_blocks(image: &Image, factor: usize) -> Result<Image, Error> {
    let Size { width, height } = image.size();
    let (columns, rows) = ((width / factor).max(1), (height / factor).max(1));
    let mut means = memory::filled("a smaller image", columns * rows, 0u8)?;
    for (row, means) in means.chunks_exact_mut(columns).enumerate() {
        let ys = row * factor..((row + 1) * factor).min(height);
        for (column, mean) in means.iter_mut().enumerate() {
            let xs = column * factor..((column + 1) * factor).min(width);
            let count = (xs.len() * ys.len()) as u64;
            let sum: u64 = ys.clone().map(|y| xs.clone().map(|x| u64::from(image.grey(x, y))).sum::<u64>()).sum();
            *mean = ((sum + count / 2) / count) as u8;
        }
    }
    Image::from_grey(columns, rows, &means)
}
