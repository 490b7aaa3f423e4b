//! Rectified stereo pairs.

use std::ops::Range;

use crate::{Error, Image, Profile, Size};

/// A rectified pair: left pixel (x, y) with disparity d and right pixel (x - d, y) show the same point.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StereoPair {
    left: Image,
    right: Image,
}

impl StereoPair {
    /// Pairs two images of the same size.
    ///
    /// # Errors
    /// [`Error::SizesDiffer`] if they differ in size.
    pub fn new(left: Image, right: Image) -> Result<Self, Error> {
        if left.size() != right.size() {
            return Err(Error::SizesDiffer { left: left.size(), right: right.size() });
        }
        Ok(Self { left, right })
    }

    /// The mirrored pair: its left image is the right image mirrored, and its right image the left one mirrored. Mirror its
    /// disparity map back to get the map of the right image, whose pixel (x, y) with disparity d and left pixel (x + d, y)
    /// show the same point.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        let (left, right) = rayon::join(|| self.right.mirrored(), || self.left.mirrored());
        Self { left, right }
    }

    /// What a profile compares of the pair: its colours, or grey values only.
    #[must_use]
    pub fn compared_by(self, profile: Profile) -> Self {
        if profile.compares_colours() {
            return self;
        }
        Self { left: self.left.without_colours(), right: self.right.without_colours() }
    }

    /// The size of both images.
    #[must_use]
    pub fn size(&self) -> Size {
        self.left.size()
    }

    /// The bytes held, which clones share.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.left.bytes() + self.right.bytes()
    }

    /// The left image, to which the disparity map belongs.
    #[must_use]
    pub fn left(&self) -> &Image {
        &self.left
    }

    /// The right image.
    #[must_use]
    pub fn right(&self) -> &Image {
        &self.right
    }

    /// Copies some rows of both images; see [`Image::strip`].
    ///
    /// # Panics
    /// As [`Image::strip`].
    #[must_use]
    pub fn strip(&self, rows: Range<usize>) -> Self {
        Self { left: self.left.strip(rows.clone()), right: self.right.strip(rows) }
    }

    /// Copies the same columns and rows of both images; see [`Image::part`].
    ///
    /// # Panics
    /// As [`Image::part`].
    #[must_use]
    pub fn part(&self, columns: Range<usize>, rows: Range<usize>) -> Self {
        let (left, right) = rayon::join(
            || self.left.part(columns.clone(), rows.clone()),
            || self.right.part(columns.clone(), rows.clone()),
        );
        Self { left, right }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_of_two_sizes_are_refused() {
        let [a, b] = [[1, 2], [2, 1]].map(|[width, height]| Image::from_grey(width, height, [0, 0]).unwrap());
        assert!(matches!(StereoPair::new(a, b), Err(Error::SizesDiffer { .. })));
    }
}
