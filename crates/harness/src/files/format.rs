//! In which formats maps are stored, and what unknown is in each.
//!
//! `.pfm`, `.tif` and `.npy` hold the values themselves in 32-bit floats, plus infinity where unknown. `.png` holds whole
//! numbers of 16 bits, 0 where unknown: 256 times a disparity, a depth in millimetres, or 65535
//! times a confidence.

use std::path::Path;

use bp_core::{DisparityMap, Size};
use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};

use super::{npy, pfm, tiff, write_whole};
use crate::failure::Failure;

/// How a map is stored, by the file's ending.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MapFormat {
    /// Portable float map.
    Pfm,
    /// PNG of 16 bits.
    Png16,
    /// TIFF of 32-bit floats.
    Tiff,
    /// NumPy's array of 32-bit floats.
    Npy,
}

impl MapFormat {
    /// The endings, for messages.
    const ENDINGS: &str = ".pfm, .png, .tif, .tiff or .npy";

    /// The format of an output path.
    pub(crate) fn of(path: &Path) -> Result<Self, Failure> {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        match ending.as_deref() {
            Some("pfm") => Ok(Self::Pfm),
            Some("png") => Ok(Self::Png16),
            Some("tif" | "tiff") => Ok(Self::Tiff),
            Some("npy") => Ok(Self::Npy),
            _ => Err(Failure::usage(format!("{}: a map ends in {}", path.display(), Self::ENDINGS))),
        }
    }

    /// Its name in sidecars.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Pfm => "PFM, 32-bit float",
            Self::Png16 => "PNG, 16-bit",
            Self::Tiff => "TIFF, 32-bit float",
            Self::Npy => "NPY, 32-bit float",
        }
    }
}

/// What the values of a map are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Quantity {
    /// Disparities in pixels.
    Disparity,
    /// Depths in millimetres.
    Depth,
    /// Confidences from 0 to 1.
    Confidence,
}

impl Quantity {
    /// Its name in sidecars.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Disparity => "disparity",
            Self::Depth => "depth",
            Self::Confidence => "confidence",
        }
    }

    /// Its unit.
    pub(crate) fn unit(self) -> &'static str {
        match self {
            Self::Disparity => "px",
            Self::Depth => "mm",
            Self::Confidence => "1",
        }
    }

    /// What values are multiplied by where they are stored as whole numbers: KITTI's for disparities.
    pub(crate) fn steps(self) -> f32 {
        match self {
            Self::Disparity => 256.0,
            Self::Depth => 1.0,
            Self::Confidence => 65535.0,
        }
    }
}

/// Values on their way to a file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Raster<'a> {
    /// Width and height.
    pub(crate) size: Size,
    /// `[height][width]`; plus infinity where unknown.
    pub(crate) values: &'a [f32],
    /// What they are.
    pub(crate) quantity: Quantity,
}

impl<'a> Raster<'a> {
    /// The disparities of a map.
    pub(crate) fn disparities(map: &'a DisparityMap) -> Self {
        Self { size: map.size(), values: map.values(), quantity: Quantity::Disparity }
    }

    /// The least and the largest known value.
    pub(crate) fn range(&self) -> Option<(f32, f32)> {
        let known = self.values.iter().filter(|value| value.is_finite()).map(|&value| (value, value));
        known.reduce(|(low, high), (value, _)| (low.min(value), high.max(value)))
    }

    /// Files of it in all formats that hold the values themselves.
    #[cfg(feature = "fuzzing")]
    pub(crate) fn floats(&self) -> [Vec<u8>; 3] {
        let written = |write: &dyn Fn(&mut Vec<u8>) -> std::io::Result<()>| {
            let mut bytes = Vec::new();
            write(&mut bytes).unwrap_or_else(|error| panic!("{error}"));
            bytes
        };
        let tiff = tiff::encode(self.size, self.values).unwrap_or_else(|error| panic!("{error}"));
        let pfm = written(&|bytes| pfm::write(bytes, self.size, self.values));
        [pfm, written(&|bytes| npy::write(bytes, self.size, self.values)), tiff]
    }

    /// Writes it in the format of the path's ending.
    pub(crate) fn write(&self, path: &Path) -> Result<(), Failure> {
        let Self { size, values, quantity } = *self;
        match MapFormat::of(path)? {
            MapFormat::Pfm => write_whole(path, |file| pfm::write(file, size, values)),
            MapFormat::Npy => write_whole(path, |file| npy::write(file, size, values)),
            MapFormat::Tiff => {
                let bytes = tiff::encode(size, values).map_err(|error| Failure::writing(path, &error))?;
                write_whole(path, |file| file.write_all(&bytes))
            }
            MapFormat::Png16 => {
                let stored = whole_numbers(values, quantity.steps()).ok_or_else(|| out_of_png_range(path))?;
                let bytes: Vec<u8> = stored.iter().flat_map(|value| value.to_ne_bytes()).collect();
                let (width, height) = (size.width as u32, size.height as u32);
                write_whole(path, |file| {
                    PngEncoder::new(file).write_image(&bytes, width, height, ExtendedColorType::L16)
                })
            }
        }
    }
}

/// Values times `steps`, at least 1; 0 where unknown. `None` where one does not fit.
fn whole_numbers(values: &[f32], steps: f32) -> Option<Vec<u16>> {
    let stored = |&value: &f32| match (value * steps).round() {
        _ if !value.is_finite() => Some(0),
        scaled if (0.0..=65535.0).contains(&scaled) => Some((scaled as u16).max(1)),
        _ => None,
    };
    values.iter().map(stored).collect()
}

/// Fails where a path's ending names no format, or one that cannot hold disparities from `low` to `high`; for telling so
/// before the work is done.
pub(crate) fn check_range(path: &Path, low: f32, high: f32) -> Result<(), Failure> {
    let fits = low >= 0.0 && (high * Quantity::Disparity.steps()).round() <= f32::from(u16::MAX);
    match MapFormat::of(path)? {
        MapFormat::Png16 if !fits => Err(out_of_png_range(path)),
        _ => Ok(()),
    }
}

fn out_of_png_range(path: &Path) -> Failure {
    let what = "a 16-bit PNG holds disparities from 0 to 255.99 px; use an output that ends in .pfm, .tif or .npy";
    Failure::usage(format!("{}: {what}", path.display()))
}

/// Fails where a path does not have an ending.
pub(crate) fn check_ending(path: &Path, what: &str, ending: &str) -> Result<(), Failure> {
    if path.extension().is_some_and(|found| found.eq_ignore_ascii_case(ending)) {
        return Ok(());
    }
    Err(Failure::usage(format!("{}: {what} ends in .{ending}", path.display())))
}
