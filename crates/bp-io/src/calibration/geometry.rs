//! The geometry of a rectified pair.

use std::path::{Path, PathBuf};

use bp_core::{Calibration, Size};

use super::Cameras;
use crate::Error;

/// A geometry that was not yet checked against the size of the images.
#[derive(Clone, Debug)]
pub struct Geometry {
    /// Focal length in pixels.
    pub focal: f64,
    /// Distance between the cameras in millimetres.
    pub baseline: f64,
    /// Column of the right principal point minus that of the left one.
    pub doffs: f64,
    /// Column and row of the left principal point; `None` means the centre of the image.
    pub principal_point: Option<[f64; 2]>,
    /// The file that the geometry was read from.
    pub file: Option<CalibrationFile>,
}

/// The file that a geometry was read from.
#[derive(Clone, Debug, PartialEq)]
pub struct CalibrationFile {
    /// Its path.
    pub path: PathBuf,
    /// The size of its images, if the file gives it.
    pub size: Option<Size>,
}

impl Geometry {
    /// Reads the geometry from a calibration, in any of the formats of [`Cameras`]; one file or two.
    ///
    /// # Errors
    /// [`Error::Read`], also if the files describe only cameras before rectification.
    pub fn read(paths: &[PathBuf]) -> Result<Self, Error> {
        Cameras::read(paths)?.into_geometry()
    }

    /// The calibration of images of this size.
    ///
    /// # Errors
    /// [`Error::Read`] if the file is for images of another size, [`Error::Request`] if no cameras have this geometry.
    pub fn of(&self, size: Size) -> Result<Calibration, Error> {
        if let Some(CalibrationFile { path, size: Some(told) }) =
            self.file.as_ref().filter(|file| file.size != Some(size))
        {
            let advice = if told.width.abs_diff(size.width) <= 1 {
                "crop the images as it says, or correct its width and height".to_owned()
            } else {
                let (more, less) = (told.width as f64, size.width as f64);
                let (verb, factor) = if more > less { ("divide", more / less) } else { ("multiply", less / more) };
                format!("where they are scaled copies, {verb} its f, cx, cy, doffs, width and height by {factor:.4}")
            };
            return Err(Error::reading(
                path,
                &format!("it is for images of {told} pixels, these have {size}; {advice}"),
            ));
        }
        self.unchecked(size).map_err(|error| self.failed(&error))
    }

    /// Fails if no cameras have this geometry, whatever the size of their images.
    pub(super) fn possible(&self) -> Result<(), bp_core::Error> {
        self.unchecked(Size { width: 1, height: 1 }).map(drop)
    }

    fn failed(&self, error: &dyn std::fmt::Display) -> Error {
        let path = self.file.as_ref().map_or(Path::new("calibration"), |file| &file.path);
        Error::request(path, error)
    }

    fn unchecked(&self, size: Size) -> Result<Calibration, bp_core::Error> {
        let middle = || [size.width, size.height].map(|side| (side as f64 - 1.0) / 2.0);
        Calibration::new(self.focal, self.baseline, self.doffs, self.principal_point.unwrap_or_else(middle))
    }
}
