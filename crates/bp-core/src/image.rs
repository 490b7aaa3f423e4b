//! Images and rectified stereo pairs.

use crate::Error;

/// Most pixels per row or column: coordinates and disparities fit `i32` with room to add.
pub const MAX_SIDE: usize = 1 << 24;

/// Width and height of an image or grid in pixels; both at least 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Size {
    /// Pixels per row (m).
    pub width: usize,
    /// Pixels per column (n).
    pub height: usize,
}

impl Size {
    /// A size.
    ///
    /// # Errors
    /// [`Error::Empty`] where a side is 0, [`Error::TooLarge`] where one exceeds [`MAX_SIDE`].
    pub fn new(width: usize, height: usize) -> Result<Self, Error> {
        let size = Self { width, height };
        if width == 0 || height == 0 {
            return Err(Error::Empty { size });
        }
        if width > MAX_SIDE || height > MAX_SIDE {
            return Err(Error::TooLarge { size });
        }
        Ok(size)
    }

    /// Number of pixels.
    #[must_use]
    pub fn pixels(self) -> usize {
        self.width * self.height
    }

    /// The next coarser grid: half the width and height, rounded up.
    #[must_use]
    pub fn coarser(self) -> Self {
        Self { width: self.width.div_ceil(2), height: self.height.div_ceil(2) }
    }
}

impl std::fmt::Display for Size {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}x{}", self.width, self.height)
    }
}

/// An image of 8-bit colours, `[height][width]`, rows from top to bottom. A grey image has three equal channels.
#[derive(Clone, PartialEq, Eq)]
pub struct Image {
    size: Size,
    pixels: Vec<[u8; 3]>,
}

impl Image {
    /// An image from its colours, `[height][width]`.
    ///
    /// # Errors
    /// As [`Size::new`]; [`Error::PixelCount`] where `pixels` does not hold `width * height` colours.
    pub fn from_rgb(width: usize, height: usize, pixels: Vec<[u8; 3]>) -> Result<Self, Error> {
        let size = Size::new(width, height)?;
        if pixels.len() != size.pixels() {
            return Err(Error::PixelCount { size, found: pixels.len() });
        }
        Ok(Self { size, pixels })
    }

    /// An image from grey values, `[height][width]`.
    ///
    /// # Errors
    /// As [`Image::from_rgb`].
    pub fn from_grey(width: usize, height: usize, pixels: &[u8]) -> Result<Self, Error> {
        Self::from_rgb(width, height, pixels.iter().map(|&v| [v; 3]).collect())
    }

    /// The same turned left to right.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        let mut pixels = self.pixels.clone();
        pixels.chunks_exact_mut(self.size.width).for_each(<[_]>::reverse);
        Self { pixels, ..*self }
    }

    /// Width and height.
    #[must_use]
    pub fn size(&self) -> Size {
        self.size
    }

    /// All colours, `[height][width]`.
    #[must_use]
    pub fn pixels(&self) -> &[[u8; 3]] {
        &self.pixels
    }

    /// The colour at column `x`, row `y`.
    ///
    /// # Panics
    /// Where (x, y) lies outside.
    #[must_use]
    pub fn rgb(&self, x: usize, y: usize) -> [u8; 3] {
        self.pixels[y * self.size.width + x]
    }

    /// The grey value at column `x`, row `y`.
    ///
    /// # Panics
    /// Where (x, y) lies outside.
    #[must_use]
    pub fn grey(&self, x: usize, y: usize) -> u8 {
        grey(self.rgb(x, y))
    }
}

impl std::fmt::Debug for Image {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Image({})", self.size)
    }
}

/// Luma of a colour in integers with the weights of ITU-R BT.601; equal channels keep their value.
#[must_use]
pub fn grey([r, g, b]: [u8; 3]) -> u8 {
    let sum = 299 * u32::from(r) + 587 * u32::from(g) + 114 * u32::from(b);
    ((sum + 500) / 1000) as u8
}

/// A 16-bit channel value as 8 bits, rounded to nearest: 65535 becomes 255.
#[must_use]
pub fn narrow(value: u16) -> u8 {
    ((u32::from(value) + 128) / 257) as u8
}

/// A rectified pair: left pixel (x, y) with disparity d shows what right pixel (x - d, y) shows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StereoPair {
    left: Image,
    right: Image,
}

impl StereoPair {
    /// A pair of two images of one size.
    ///
    /// # Errors
    /// [`Error::SizesDiffer`].
    pub fn new(left: Image, right: Image) -> Result<Self, Error> {
        if left.size() != right.size() {
            return Err(Error::SizesDiffer { left: left.size(), right: right.size() });
        }
        Ok(Self { left, right })
    }

    /// The pair in a mirror: the right image, turned left to right, is its left one and the other way round. What is its
    /// disparity map in the mirror is the right image's: right pixel (x, y) with disparity d shows what left pixel
    /// (x + d, y) shows.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        Self { left: self.right.mirrored(), right: self.left.mirrored() }
    }

    /// The size of both images.
    #[must_use]
    pub fn size(&self) -> Size {
        self.left.size()
    }

    /// The left image: the one that the disparity map belongs to.
    #[must_use]
    pub fn left(&self) -> &Image {
        &self.left
    }

    /// The right image.
    #[must_use]
    pub fn right(&self) -> &Image {
        &self.right
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grey_keeps_grey_and_rounds_the_weights() {
        assert!((0..=255).all(|v| grey([v; 3]) == v));
        assert_eq!([grey([255, 0, 0]), grey([0, 255, 0]), grey([0, 0, 255])], [76, 150, 29]);
    }

    #[test]
    fn narrow_inverts_widening_by_257() {
        assert!((0..=255u8).all(|v| narrow(u16::from(v) * 257) == v));
        assert_eq!([narrow(128), narrow(129), narrow(u16::MAX)], [0, 1, 255]);
    }

    #[test]
    fn bad_sizes_are_refused() {
        assert!(matches!(Image::from_grey(0, 3, &[]), Err(Error::Empty { .. })));
        assert!(matches!(Image::from_grey(2, 2, &[1, 2, 3]), Err(Error::PixelCount { found: 3, .. })));
        assert!(matches!(Size::new(MAX_SIDE + 1, 1), Err(Error::TooLarge { .. })));
        let (a, b) = (Image::from_grey(1, 2, &[0, 0]), Image::from_grey(2, 1, &[0, 0]));
        assert!(matches!(StereoPair::new(a.unwrap(), b.unwrap()), Err(Error::SizesDiffer { .. })));
    }
}
