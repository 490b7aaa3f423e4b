//! Calibrations of two cameras, in the formats of the programs that make them.

mod geometry;
mod kalibr;
mod kitti;
mod middlebury;
mod opencv;
mod ros;
mod tree;

use std::path::{Path, PathBuf};

use bp_core::{Camera, Lens, Rectification, Rectifier, Rig, Size};

pub use geometry::{CalibrationFile, Geometry};

use crate::{Contents, Error, read::MOST_DESCRIPTION};
use tree::Tree;

/// What calibration files say of two cameras: of their rectified images, of the cameras before rectification, or of both.
///
/// The format is recognised by content: Middlebury's `calib.txt`; OpenCV's YAML, XML or JSON with its usual names (M1 or K1 or
/// cameraMatrix1, D1 or distCoeffs1, R, T, R1, R2, P1, P2, Q); two ROS `camera_info` files; KITTI's `calib_cam_to_cam.txt` and lists
/// of projections; Kalibr's `camchain.yaml`. Lengths in OpenCV's files are taken as millimetres, in the last three as metres.
#[derive(Clone, Debug)]
pub struct Cameras {
    path: PathBuf,
    geometry: Option<Geometry>,
    raw: Option<Raw>,
}

/// Two cameras before rectification.
#[derive(Clone, Debug)]
struct Raw {
    lenses: [Optics; 2],
    rotation: [[f64; 3]; 3],
    /// In millimetres.
    translation: [f64; 3],
    /// The size of their images, if the file gives it.
    size: Option<Size>,
    /// How the file rectifies them, if it says so. Without a size, the rectified images have that of the raw ones.
    rectification: Option<Rectified>,
}

/// What a camera matrix and its distortion coefficients say.
#[derive(Clone, Copy, Debug)]
struct Optics {
    focal: [f64; 2],
    principal_point: [f64; 2],
    lens: Lens,
}

/// A rectification as files give it.
#[derive(Clone, Debug)]
struct Rectified {
    rotations: [[[f64; 3]; 3]; 2],
    geometry: Geometry,
    size: Option<Size>,
}

impl Cameras {
    /// Reads a calibration from its files: one, or two where the left and the right camera, or intrinsic and extrinsic
    /// parameters, have a file each.
    ///
    /// # Errors
    /// [`Error::Read`].
    pub fn read(paths: &[PathBuf]) -> Result<Self, Error> {
        let read = |path: &PathBuf| Ok((path.clone(), Contents::of(path, MOST_DESCRIPTION)?.bytes));
        Self::parse(&paths.iter().map(read).collect::<Result<Vec<_>, Error>>()?)
    }

    /// Parses files in memory; messages call them by their paths.
    ///
    /// # Errors
    /// [`Error::Read`].
    pub fn parse(files: &[(PathBuf, Vec<u8>)]) -> Result<Self, Error> {
        let texts = files.iter().map(text).collect::<Result<Vec<_>, _>>()?;
        let [first, rest @ ..] = &texts[..] else {
            return Err(Error::reading(Path::new("calibration"), &"no file is given"));
        };
        if rest.len() > 1 {
            return Err(Error::reading(rest[1].0, &"a calibration has one file, or two"));
        }
        if rest.is_empty() && middlebury::is_it(first.1) {
            let geometry = middlebury::geometry(first.0, first.1)?;
            return Ok(Self { path: first.0.to_owned(), geometry: Some(geometry), raw: None });
        }
        let trees = texts.iter().map(|(path, text)| Tree::parse(path, text)).collect::<Result<Vec<_>, _>>()?;
        Self::of(&trees)
    }

    fn of(trees: &[Tree<'_>]) -> Result<Self, Error> {
        let [first, rest @ ..] = trees else { unreachable!("a calibration has a file") };
        let alone = |cameras: Result<Self, Error>| match rest {
            [second, ..] => Err(second.failed("this calibration has one file; leave this one out")),
            [] => cameras,
        };
        match first {
            tree if ros::is_it(tree) => ros::cameras(tree, rest.first()),
            tree if kitti::is_it(tree) => alone(kitti::cameras(tree)),
            tree if kalibr::is_it(tree) => alone(kalibr::cameras(tree)),
            _ => opencv::cameras(trees),
        }
    }

    /// The geometry of the rectified pair, if the files describe one.
    #[must_use]
    pub fn geometry(&self) -> Option<&Geometry> {
        self.geometry.as_ref()
    }

    fn into_geometry(self) -> Result<Geometry, Error> {
        let missing =
            "it describes cameras before rectification; if the images are not rectified yet, ask for that too";
        self.geometry.ok_or_else(|| Error::reading(&self.path, &missing))
    }

    /// Prepares the rectification of raw images of this size: the one that the files describe, or else the view that shows
    /// nothing black ([`Rectification::of`]).
    ///
    /// # Errors
    /// [`Error::Read`] if the files do not describe such cameras.
    pub fn rectifier(&self, size: Size) -> Result<Rectifier, Error> {
        let failed = |reason: &dyn std::fmt::Display| Error::reading(&self.path, reason);
        let missing =
            "it says nothing of the cameras before rectification: no camera matrices, rotation and translation";
        let raw = self.raw.as_ref().ok_or_else(|| failed(&missing))?;
        if let Some(told) = raw.size.filter(|told| *told != size) {
            return Err(failed(&format!("it is for images of {told} pixels, these have {size}")));
        }
        let rig = raw.rig(size);
        let rectification = match &raw.rectification {
            Some(rectified) => rectified.of(size)?,
            None => Rectification::of(&rig, 0.0).map_err(|error| failed(&error))?,
        };
        Rectifier::new(&rig, rectification).map_err(|error| failed(&error))
    }
}

impl Raw {
    fn rig(&self, size: Size) -> Rig {
        let camera = |Optics { focal, principal_point, lens }| Camera { size, focal, principal_point, lens };
        Rig { cameras: self.lenses.map(camera), rotation: self.rotation, translation: self.translation }
    }
}

impl Rectified {
    fn of(&self, raw: Size) -> Result<Rectification, Error> {
        let size = self.size.unwrap_or(raw);
        if size.pixels() > raw.pixels() {
            let path = self.geometry.file.as_ref().map_or(Path::new("calibration"), |file| &file.path);
            let what = format!("its rectified images of {size} pixels are larger than the raw ones of {raw}");
            return Err(Error::reading(path, &what));
        }
        let calibration = self.geometry.of(size)?;
        let [column, row] = calibration.principal_point();
        let principal_points = [[column, row], [column + calibration.doffs(), row]];
        let (focal, baseline) = (calibration.focal(), calibration.baseline());
        Ok(Rectification { rotations: self.rotations, size, focal, principal_points, baseline })
    }
}

fn text((path, bytes): &(PathBuf, Vec<u8>)) -> Result<(&Path, &str), Error> {
    let text = std::str::from_utf8(bytes).map_err(|_| Error::reading(path, &"not a calibration: it is no text"))?;
    Ok((path, text))
}
