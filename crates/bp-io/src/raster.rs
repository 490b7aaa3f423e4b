//! One value per pixel, to be written to a file.

use std::{borrow::Cow, path::Path};

use bp_core::{DisparityMap, Size};
use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};

use crate::{Error, Files, MapFormat, Quantity, Staged, format::out_of_png_range, npy, pfm, tiff};

/// One value per pixel, to be written to a file.
#[derive(Clone, Copy, Debug)]
pub struct Raster<'a> {
    /// Width and height.
    pub size: Size,
    /// `[height][width]`; plus infinity means unknown.
    pub values: &'a [f32],
    /// The quantity of the values.
    pub quantity: Quantity,
    /// Whether the formats TIFF and NPY hold NaN for unknown, and not plus infinity.
    pub nan: bool,
    /// Whether the file holds the negative of each known value.
    pub negate: bool,
}

impl<'a> Raster<'a> {
    /// The disparities of a map.
    #[must_use]
    pub fn disparities(map: &'a DisparityMap) -> Self {
        Self { size: map.size(), values: map.values(), quantity: Quantity::Disparity, nan: false, negate: false }
    }

    /// The least and the largest known value.
    #[must_use]
    pub fn range(&self) -> Option<(f32, f32)> {
        let known = self.values.iter().filter(|value| value.is_finite()).map(|&value| (value, value));
        known.reduce(|(low, high), (value, _)| (low.min(value), high.max(value)))
    }

    /// What the stored values are multiplied by to get the values: 1, or -1 if they are negated.
    pub(crate) fn sign(&self) -> f32 {
        if self.negate { -1.0 } else { 1.0 }
    }

    /// Whether a format holds NaN for unknown.
    pub(crate) fn has_nan(&self, format: MapFormat) -> bool {
        self.nan && matches!(format, MapFormat::Tiff | MapFormat::Npy)
    }

    /// The values as a format of floats holds them.
    fn stored(&self, format: MapFormat) -> Cow<'a, [f32]> {
        let unknown = if self.has_nan(format) { f32::NAN } else { DisparityMap::UNKNOWN };
        if !self.negate && !unknown.is_nan() {
            return Cow::Borrowed(self.values);
        }
        self.values.iter().map(|&value| if value.is_finite() { self.sign() * value } else { unknown }).collect()
    }

    /// Encodes the values in memory, in a format of floats. `None` for [`MapFormat::Png16`], which rounds.
    ///
    /// # Errors
    /// Those of the encoder, as text.
    pub fn floats(&self, format: MapFormat) -> Option<Result<Vec<u8>, String>> {
        let (size, values) = (self.size, &*self.stored(format));
        let mut bytes = Vec::new();
        let written = match format {
            MapFormat::Png16 => return None,
            MapFormat::Pfm => pfm::write(&mut bytes, size, values).map_err(|error| error.to_string()),
            MapFormat::Npy => npy::write(&mut bytes, size, values).map_err(|error| error.to_string()),
            MapFormat::Tiff => {
                tiff::encode(size, values).map(|encoded| bytes = encoded).map_err(|error| error.to_string())
            }
        };
        Some(written.map(|()| bytes))
    }

    /// Writes the values in the format of the path's extension.
    ///
    /// # Errors
    /// [`Error::Request`] if the format cannot hold a value, [`Error::Write`].
    pub fn write(&self, files: &Files, path: &Path) -> Result<(), Error> {
        self.staged(files, path)?.put()
    }

    /// Writes the values in the format of the path's extension, see [`Files::staged`].
    ///
    /// # Errors
    /// Those of [`Raster::write`].
    pub fn staged(&self, files: &Files, path: &Path) -> Result<Staged, Error> {
        let Self { size, quantity, .. } = *self;
        let format = MapFormat::of(path)?;
        let values = &*self.stored(format);
        match format {
            MapFormat::Pfm => files.staged(path, |file| pfm::write(file, size, values)),
            MapFormat::Npy => files.staged(path, |file| npy::write(file, size, values)),
            MapFormat::Tiff => {
                let bytes = tiff::encode(size, values).map_err(|error| Error::writing(path, &error))?;
                files.staged(path, |file| file.write_all(&bytes))
            }
            MapFormat::Png16 => {
                let stored = whole_numbers(values, quantity.steps()).ok_or_else(|| out_of_png_range(path))?;
                let bytes: Vec<u8> = stored.iter().flat_map(|value| value.to_ne_bytes()).collect();
                let (width, height) = (size.width as u32, size.height as u32);
                files.staged(path, |file| {
                    PngEncoder::new(file).write_image(&bytes, width, height, ExtendedColorType::L16)
                })
            }
        }
    }
}

/// Values times `steps`, rounded and at least 1; 0 means unknown. `None` if a value does not fit.
fn whole_numbers(values: &[f32], steps: f32) -> Option<Vec<u16>> {
    let stored = |&value: &f32| match (value * steps).round() {
        _ if !value.is_finite() => Some(0),
        scaled if (0.0..=65535.0).contains(&scaled) => Some((scaled as u16).max(1)),
        _ => None,
    };
    values.iter().map(stored).collect()
}
