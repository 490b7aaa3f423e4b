//! The geometry of a pair, from options or from a `calib.txt` in the format of Middlebury 2014 and 2021 and of ETH3D.

use std::path::{Path, PathBuf};

use bp_core::{Calibration, Size};

use crate::{Contents, Error, read::MOST_DESCRIPTION};

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
    /// Reads a `calib.txt`.
    ///
    /// # Errors
    /// [`Error::Read`].
    pub fn read(path: &Path) -> Result<Self, Error> {
        Self::parse(path, &Contents::of(path, MOST_DESCRIPTION)?.bytes)
    }

    /// Parses a `calib.txt` in memory; messages call it `path`.
    ///
    /// # Errors
    /// [`Error::Read`].
    pub fn parse(path: &Path, bytes: &[u8]) -> Result<Self, Error> {
        let failed = |error: &dyn std::fmt::Display| Error::reading(path, error);
        let text = std::str::from_utf8(bytes).map_err(|_| failed(&"not a calibration: it is no text"))?;
        let entries = Entries { path, text };
        let [focal, skew, column, zero, focal_down, row] = entries.camera("cam0")?;
        if skew != 0.0 || zero != 0.0 || (focal_down / focal - 1.0).abs() > 1e-3 {
            return Err(failed(&"cam0 is no rectified camera [f 0 cx; 0 f cy; 0 0 1] of one focal length"));
        }
        let geometry = Self {
            focal,
            baseline: entries.number("baseline", "the distance of the cameras in millimetres")?,
            doffs: entries.number("doffs", "the column of cam1's principal point less that of cam0's")?,
            principal_point: Some([column, row]),
            file: Some(CalibrationFile { path: path.to_owned(), size: entries.size()? }),
        };
        geometry.unchecked(Size { width: 1, height: 1 }).map_err(|error| failed(&error))?;
        Ok(geometry)
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

    fn failed(&self, error: &dyn std::fmt::Display) -> Error {
        let path = self.file.as_ref().map_or(Path::new("calibration"), |file| &file.path);
        Error::request(path, error)
    }

    fn unchecked(&self, size: Size) -> Result<Calibration, bp_core::Error> {
        let middle = || [size.width, size.height].map(|side| (side as f64 - 1.0) / 2.0);
        Calibration::new(self.focal, self.baseline, self.doffs, self.principal_point.unwrap_or_else(middle))
    }
}

/// The lines `name=value` of a file.
struct Entries<'a> {
    path: &'a Path,
    text: &'a str,
}

impl Entries<'_> {
    fn failed(&self, what: &str) -> Error {
        Error::reading(self.path, &what)
    }

    fn find(&self, name: &str) -> Option<&str> {
        let lines = self.text.lines().filter_map(|line| line.split_once('='));
        lines
            .map(|(found, value)| (found.trim(), value.trim()))
            .find(|(found, _)| *found == name)
            .map(|(_, value)| value)
    }

    fn required(&self, name: &str, what: &str) -> Result<&str, Error> {
        self.find(name).ok_or_else(|| self.failed(&format!("there is no line {name}=..., {what}")))
    }

    fn number(&self, name: &str, what: &str) -> Result<f64, Error> {
        let text = self.required(name, what)?;
        finite(text).ok_or_else(|| self.failed(&format!("{name}={text:.40} should be a number, {what}")))
    }

    /// The first two rows of a camera's matrix.
    fn camera(&self, name: &str) -> Result<[f64; 6], Error> {
        let what = "the left camera [f 0 cx; 0 f cy; 0 0 1]";
        let text = self.required(name, what)?;
        let inside = text.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
        let words = inside.into_iter().flat_map(|inside| inside.split([';', ' ', ','])).filter(|word| !word.is_empty());
        let numbers: Option<Vec<f64>> = words.map(finite).collect();
        match numbers.as_deref() {
            Some(&[a, b, c, d, e, f, 0.0, 0.0, 1.0]) => Ok([a, b, c, d, e, f]),
            _ => Err(self.failed(&format!("{name}={text:.80} should be {what}"))),
        }
    }

    /// The size of the images, if both sides are given.
    fn size(&self) -> Result<Option<Size>, Error> {
        let side = |name: &str| -> Result<Option<usize>, Error> {
            let wrong = |text| self.failed(&format!("{name}={text:.40} should be a number of pixels"));
            self.find(name).map(|text| text.parse().map_err(|_| wrong(text))).transpose()
        };
        Ok(side("width")?.zip(side("height")?).map(|(width, height)| Size { width, height }))
    }
}

fn finite(text: &str) -> Option<f64> {
    text.parse().ok().filter(|value: &f64| value.is_finite())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    const MOTORCYCLE: &str = "cam0=[3979.911 0 1244.772; 0 3979.911 1019.507; 0 0 1]\n\
        cam1=[3979.911 0 1369.115; 0 3979.911 1019.507; 0 0 1]\n\
        doffs=124.343\nbaseline=193.001\nwidth=2964\nheight=2000\nndisp=280\nisint=0\n";

    fn read(text: &str) -> Result<Geometry, Error> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("calib.txt");
        fs::write(&path, text).unwrap();
        Geometry::read(&path)
    }

    #[test]
    fn middleburys_files_are_read() {
        let geometry = read(MOTORCYCLE).unwrap();
        let calibration = geometry.of(Size { width: 2964, height: 2000 }).unwrap();
        assert_eq!(calibration, Calibration::new(3979.911, 193.001, 124.343, [1244.772, 1019.507]).unwrap());
        let quarter = geometry.of(Size { width: 741, height: 500 }).unwrap_err().to_string();
        assert!(quarter.contains("2964x2000") && quarter.contains("divide") && quarter.contains("4.0000"), "{quarter}");
        let windows = read(&MOTORCYCLE.replace('\n', "\r\n").replace('=', " = ")).unwrap();
        assert_eq!(windows.of(Size { width: 2964, height: 2000 }).unwrap(), calibration);
    }

    #[test]
    fn broken_files_tell_what_is_wrong() {
        let line = |name: &str| MOTORCYCLE.lines().find(|line| line.starts_with(name)).unwrap();
        for (name, instead, word) in [
            ("doffs", "", "doffs"),
            ("doffs", "doffs=nan", "doffs=nan"),
            ("baseline", "baseline=-1", "baseline"),
            ("baseline", "baseline=wide", "baseline=wide"),
            ("cam0", "cam0=[0 0 1; 0 0 1; 0 0 1]", "focal length"),
            ("cam0", "cam0=[5 0 1; 0 9 1; 0 0 1]", "rectified camera"),
            ("cam0", "cam0=[-5 0 1; 0 -5 1; 0 0 1]", "focal length"),
            ("cam0", "cam0=5", "cam0=5"),
            ("width", "width=-2", "width=-2"),
        ] {
            let message = read(&MOTORCYCLE.replace(line(name), instead)).unwrap_err().to_string();
            assert!(message.contains("calib.txt") && message.contains(word), "{instead}: {message}");
        }
        assert!(read("").is_err());
    }
}
