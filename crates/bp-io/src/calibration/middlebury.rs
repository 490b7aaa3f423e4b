//! Middlebury's `calib.txt`, of the benchmarks of 2014 and 2021 and of ETH3D: lines `name=value`.

use std::path::Path;

use bp_core::Size;

use super::{CalibrationFile, Geometry};
use crate::Error;

/// Whether a text has the line that every such file needs.
pub(super) fn is_it(text: &str) -> bool {
    text.lines().any(|line| line.split_once('=').is_some_and(|(name, _)| name.trim() == "cam0"))
}

/// The geometry that a file describes.
pub(super) fn geometry(path: &Path, text: &str) -> Result<Geometry, Error> {
    let failed = |error: &dyn std::fmt::Display| Error::reading(path, error);
    let entries = Entries { path, text };
    let [focal, skew, column, zero, focal_down, row] = entries.camera("cam0")?;
    if skew != 0.0 || zero != 0.0 || (focal_down / focal - 1.0).abs() > 1e-3 {
        return Err(failed(&"cam0 is no rectified camera [f 0 cx; 0 f cy; 0 0 1] of one focal length"));
    }
    let geometry = Geometry {
        focal,
        baseline: entries.number("baseline", "the distance of the cameras in millimetres")?,
        doffs: entries.number("doffs", "the column of cam1's principal point less that of cam0's")?,
        principal_point: Some([column, row]),
        file: Some(CalibrationFile { path: path.to_owned(), size: entries.size()? }),
    };
    geometry.possible().map_err(|error| failed(&error))?;
    Ok(geometry)
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
    use bp_core::Calibration;

    use super::*;

    const MOTORCYCLE: &str = "cam0=[3979.911 0 1244.772; 0 3979.911 1019.507; 0 0 1]\n\
        cam1=[3979.911 0 1369.115; 0 3979.911 1019.507; 0 0 1]\n\
        doffs=124.343\nbaseline=193.001\nwidth=2964\nheight=2000\nndisp=280\nisint=0\n";

    fn read(text: &str) -> Result<Geometry, Error> {
        geometry(Path::new("calib.txt"), text)
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
