//! Disparity maps.

use fearless_simd::{Level, Simd, dispatch};
use rayon::prelude::*;

use crate::{Error, Model, Size, memory::Buffer};

/// A disparity map `[height][width]`. Disparities are in pixels of the map's own size. Unknown pixels hold
/// [`DisparityMap::UNKNOWN`].
#[derive(Clone, Debug, PartialEq)]
pub struct DisparityMap {
    size: Size,
    values: Buffer<f32>,
}

impl DisparityMap {
    /// The value of an unknown pixel, as in Middlebury's PFM files: plus infinity.
    pub const UNKNOWN: f32 = f32::INFINITY;

    /// A map from its values, `[height][width]`. Values that are not finite count as unknown.
    ///
    /// # Errors
    /// [`Error::PixelCount`] if `values` does not hold one value per pixel.
    pub fn new(size: Size, mut values: Vec<f32>) -> Result<Self, Error> {
        if values.len() != size.pixels() {
            return Err(Error::PixelCount { size, found: values.len() });
        }
        for value in &mut values {
            if !value.is_finite() {
                *value = Self::UNKNOWN;
            }
        }
        Ok(Self { size, values: values.into() })
    }

    /// The disparities of a model's labels, `[height][width]`.
    ///
    /// # Errors
    /// [`Error::PixelCount`] if `labels` does not hold one label per pixel, [`Error::OutOfMemory`].
    pub fn from_labels(size: Size, model: &Model, labels: &[u16]) -> Result<Self, Error> {
        if labels.len() != size.pixels() {
            return Err(Error::PixelCount { size, found: labels.len() });
        }
        let values = Buffer::mapped("a disparity map", labels, |&label| model.disparity(label) as f32)?;
        Ok(Self { size, values })
    }

    /// A map of finite values and [`DisparityMap::UNKNOWN`], one per pixel.
    pub(crate) fn of(size: Size, values: Buffer<f32>) -> Self {
        debug_assert!(
            values.len() == size.pixels() && values.iter().all(|&value| value.is_finite() || value == Self::UNKNOWN)
        );
        Self { size, values }
    }

    /// The map mirrored left to right.
    #[must_use]
    pub fn mirrored(self) -> Self {
        let width = self.size.width;
        self.replaced(|values| values.chunks_exact_mut(width).for_each(<[f32]>::reverse))
    }

    /// The map with its known disparities limited to `least..=largest`.
    ///
    /// # Panics
    /// If `least` is above `largest`.
    #[must_use]
    pub fn limited(self, least: f32, largest: f32) -> Self {
        let limit = |value: &mut f32| *value = value.clamp(least, largest);
        self.replaced(|values| values.iter_mut().filter(|value| value.is_finite()).for_each(limit))
    }

    /// Makes the pixels unknown that are not valid, `[height][width]`.
    ///
    /// # Panics
    /// If `valid` does not hold one value per pixel.
    pub fn restrict(&mut self, valid: &[bool]) {
        assert_eq!(valid.len(), self.size.pixels(), "one value a pixel");
        for (value, _) in self.values.iter_mut().zip(valid).filter(|(_, valid)| !**valid) {
            *value = Self::UNKNOWN;
        }
    }

    /// The map after `change` has edited its values. `change` must set non-finite values to [`DisparityMap::UNKNOWN`].
    pub(crate) fn replaced(mut self, change: impl FnOnce(&mut [f32])) -> Self {
        change(&mut self.values);
        self
    }

    /// Width and height.
    #[must_use]
    pub fn size(&self) -> Size {
        self.size
    }

    /// All values, `[height][width]`.
    #[must_use]
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// All values, `[height][width]`, without a copy.
    #[must_use]
    pub fn into_values(self) -> Buffer<f32> {
        self.values
    }

    /// The disparity at column `x`, row `y`; `None` if it is unknown.
    ///
    /// # Panics
    /// If (x, y) lies outside the image.
    #[must_use]
    pub fn at(&self, x: usize, y: usize) -> Option<f32> {
        let value = self.values[y * self.size.width + x];
        value.is_finite().then_some(value)
    }

    /// The smallest and the largest known disparity; `None` if no pixel is known.
    #[must_use]
    pub fn range(&self) -> Option<(f32, f32)> {
        known(range_of(&self.values))
    }

    /// [`DisparityMap::range`], found by the threads of the current pool.
    pub(crate) fn range_by_threads(&self) -> Option<(f32, f32)> {
        known(self.values.par_chunks(TOGETHER).map(range_of).reduce(|| NOTHING, joined))
    }
}

/// How many values one thread works on at a time.
const TOGETHER: usize = 1 << 15;

/// How many of them are compared in one step.
const PIECE: usize = 32;

/// The range of no values.
const NOTHING: (f32, f32) = (f32::INFINITY, f32::NEG_INFINITY);

/// A range, if there are any values in it.
fn known(range: (f32, f32)) -> Option<(f32, f32)> {
    (range.0 <= range.1).then_some(range)
}

fn joined(a: (f32, f32), b: (f32, f32)) -> (f32, f32) {
    (a.0.min(b.0), a.1.max(b.1))
}

/// The smallest and the largest known value.
fn range_of(values: &[f32]) -> (f32, f32) {
    let (pieces, rest) = values.as_chunks();
    let mut last = [DisparityMap::UNKNOWN; PIECE];
    last[..rest.len()].copy_from_slice(rest);
    dispatch!(Level::new(), simd => simd.vectorize(
        #[inline(always)]
        || range_of_pieces(pieces.iter().chain([&last])),
    ))
}

#[inline(always)]
fn range_of_pieces<'a>(pieces: impl Iterator<Item = &'a [f32; PIECE]>) -> (f32, f32) {
    // A range for every place in a piece, because each step of one waits for the step before.
    let (mut lows, mut highs) = ([NOTHING.0; PIECE], [NOTHING.1; PIECE]);
    for piece in pieces {
        for ((low, high), &value) in lows.iter_mut().zip(&mut highs).zip(piece) {
            let known = if value == DisparityMap::UNKNOWN { f32::NEG_INFINITY } else { value };
            // Unlike `min` and `max`, these need not look for NaN.
            *low = if value < *low { value } else { *low };
            *high = if known > *high { known } else { *high };
        }
    }
    lows.into_iter().zip(highs).fold(NOTHING, joined)
}
