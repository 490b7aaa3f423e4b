//! The formats of maps, and how each stores unknown values.
//!
//! `.pfm`, `.tif` and `.npy` hold the values themselves as 32-bit floats, with plus infinity for unknown. `.png` holds
//! 16-bit integers, with 0 for unknown: 256 times a disparity, a depth in millimetres, or 65535 times a confidence.

use std::path::Path;

use crate::{Error, write::is_stream};

/// The format of a map, selected by the file's extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapFormat {
    /// Portable float map.
    Pfm,
    /// 16-bit PNG.
    Png16,
    /// TIFF with 32-bit floats.
    Tiff,
    /// NumPy array of 32-bit floats.
    Npy,
}

impl MapFormat {
    /// The extensions, for messages.
    pub const ENDINGS: &str = ".pfm, .png, .tif, .tiff or .npy";

    /// The format of an output path.
    ///
    /// # Errors
    /// [`Error::Request`] for an unknown extension.
    pub fn of(path: &Path) -> Result<Self, Error> {
        let format = match path.extension() {
            Some(ending) => Self::named(&ending.to_string_lossy()),
            None => is_stream(path).then_some(Self::Pfm),
        };
        format.ok_or_else(|| Error::request(path, &format!("a map ends in {}", Self::ENDINGS)))
    }

    /// The format of files with this extension, which is given without a dot.
    #[must_use]
    pub fn named(ending: &str) -> Option<Self> {
        match ending.to_lowercase().as_str() {
            "pfm" => Some(Self::Pfm),
            "png" => Some(Self::Png16),
            "tif" | "tiff" => Some(Self::Tiff),
            "npy" => Some(Self::Npy),
            _ => None,
        }
    }

    /// Its name in sidecars.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Pfm => "PFM, 32-bit float",
            Self::Png16 => "PNG, 16-bit",
            Self::Tiff => "TIFF, 32-bit float",
            Self::Npy => "NPY, 32-bit float",
        }
    }
}

/// The quantity that a map holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Disparities in pixels.
    Disparity,
    /// Depths in millimetres.
    Depth,
    /// Confidences from 0 to 1.
    Confidence,
}

impl Quantity {
    /// Its name in sidecars.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Disparity => "disparity",
            Self::Depth => "depth",
            Self::Confidence => "confidence",
        }
    }

    /// Its unit.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::Disparity => "px",
            Self::Depth => "mm",
            Self::Confidence => "1",
        }
    }

    /// The factor by which values are multiplied when stored as integers; for disparities, that of KITTI.
    #[must_use]
    pub fn steps(self) -> f32 {
        match self {
            Self::Disparity => 256.0,
            Self::Depth => 1.0,
            Self::Confidence => 65535.0,
        }
    }
}

/// Fails if the extension of a path is unknown, or if its format cannot hold disparities from `low` to `high`. A caller
/// can report this before the work begins.
///
/// # Errors
/// [`Error::Request`].
pub fn check_range(path: &Path, low: f32, high: f32) -> Result<(), Error> {
    let fits = low >= 0.0 && (high * Quantity::Disparity.steps()).round() <= f32::from(u16::MAX);
    match MapFormat::of(path)? {
        MapFormat::Png16 if !fits => Err(out_of_png_range(path)),
        _ => Ok(()),
    }
}

pub(crate) fn out_of_png_range(path: &Path) -> Error {
    let what = "a 16-bit PNG holds disparities from 0 to 255.99 px; use an output that ends in .pfm, .tif or .npy";
    Error::request(path, &what)
}

/// Fails if a path does not have this extension.
///
/// # Errors
/// [`Error::Request`].
pub fn check_ending(path: &Path, what: &str, ending: &str) -> Result<(), Error> {
    if path.extension().is_some_and(|found| found.eq_ignore_ascii_case(ending)) {
        return Ok(());
    }
    Err(Error::request(path, &format!("{what} ends in .{ending}")))
}
