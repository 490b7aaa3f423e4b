//! In which formats maps are stored, and what unknown is in each.
//!
//! `.pfm`, `.tif` and `.npy` hold the values themselves in 32-bit floats, plus infinity where unknown. `.png` holds whole
//! numbers of 16 bits, 0 where unknown: 256 times a disparity, a depth in millimetres, or 65535
//! times a confidence.

use std::path::Path;

use crate::{Error, write::is_stream};

/// How a map is stored, by the file's ending.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapFormat {
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
    ///
    /// # Errors
    /// [`Error::Request`] where the ending is none of these.
    pub fn of(path: &Path) -> Result<Self, Error> {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        match ending.as_deref() {
            Some("pfm") => Ok(Self::Pfm),
            Some("png") => Ok(Self::Png16),
            Some("tif" | "tiff") => Ok(Self::Tiff),
            Some("npy") => Ok(Self::Npy),
            None if is_stream(path) => Ok(Self::Pfm),
            _ => Err(Error::request(path, &format!("a map ends in {}", Self::ENDINGS))),
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

/// What the values of a map are.
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

    /// What values are multiplied by where they are stored as whole numbers: KITTI's for disparities.
    #[must_use]
    pub fn steps(self) -> f32 {
        match self {
            Self::Disparity => 256.0,
            Self::Depth => 1.0,
            Self::Confidence => 65535.0,
        }
    }
}

/// Fails where a path's ending names no format, or one that cannot hold disparities from `low` to `high`, so that a
/// caller can say so before the work is done.
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

/// Fails where a path does not have an ending.
///
/// # Errors
/// [`Error::Request`].
pub fn check_ending(path: &Path, what: &str, ending: &str) -> Result<(), Error> {
    if path.extension().is_some_and(|found| found.eq_ignore_ascii_case(ending)) {
        return Ok(());
    }
    Err(Error::request(path, &format!("{what} ends in .{ending}")))
}
