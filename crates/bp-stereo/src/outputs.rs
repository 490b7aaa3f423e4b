//! The files that are made from a map.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use bp_core::{Calibration, DisparityMap, Image, Plan, Size, depth_map, points};
use bp_io::{
    Files, Geometry, MapFormat, Origin, Picture, Quantity, Raster, check_distinct, check_ending, check_range,
    is_stream, put_described, sidecar_of, staged_picture_sidecar, staged_sidecar, write_points,
};

use crate::{Error, Rectifying, Watch, description};

/// The paths of the files that are made from one map.
#[derive(Clone, Debug, Default)]
pub struct Outputs {
    /// The disparity map.
    pub map: Option<PathBuf>,
    /// A coloured picture of it.
    pub picture: Option<PathBuf>,
    /// A depth map.
    pub depth: Option<PathBuf>,
    /// A point cloud.
    pub points: Option<PathBuf>,
    /// A map of the confidence.
    pub confidence: Option<PathBuf>,
}

/// How the files of every pair are made.
#[derive(Clone, Debug, Default)]
pub struct Making {
    /// How pictures look.
    pub picture: Picture,
    /// Whether no sidecar is written beside maps and pictures.
    pub no_sidecar: bool,
    /// Whether the formats TIFF and NPY hold NaN for unknown, and not plus infinity.
    pub nan: bool,
    /// Whether maps hold the negative of each disparity, as programs do that count the right column minus the left one. Pictures,
    /// depth and points stay as they are.
    pub negate: bool,
    /// The geometry of rectified pairs, which depth and points need.
    pub geometry: Option<Geometry>,
    /// Rectifies pairs before they are matched. Depth and points are then those of its view.
    pub rectifying: Option<Arc<Rectifying>>,
    /// How files are written.
    pub files: Files,
}

/// The data that files are made from.
#[derive(Clone, Copy, Debug)]
pub struct Content<'a> {
    /// The map.
    pub map: &'a DisparityMap,
    /// The confidence of each pixel, `[height][width]`.
    pub confidence: Option<&'a [f32]>,
    /// The left image, which gives points their colours.
    pub image: Option<&'a Image>,
    /// The settings of the match, if known.
    pub plan: Option<&'a description::Settings>,
    /// The files that the map was made from.
    pub inputs: &'a [&'a Path],
}

impl Making {
    /// The files of the calibration.
    #[must_use]
    pub fn calibration_files(&self) -> Vec<&Path> {
        match (&self.rectifying, &self.geometry) {
            (Some(rectifying), _) => rectifying.files().iter().map(PathBuf::as_path).collect(),
            (None, Some(Geometry { file: Some(file), .. })) => vec![&file.path],
            _ => Vec::new(),
        }
    }

    /// The values of a map as its file holds them.
    #[must_use]
    pub fn raster<'a>(&self, map: &'a DisparityMap) -> Raster<'a> {
        Raster { negate: self.negate, ..Raster::disparities(map) }
    }

    /// Whether a sidecar is written beside this file.
    fn has_sidecar(&self, path: &Path) -> bool {
        !self.no_sidecar && !is_stream(path)
    }

    /// The calibration of images of this size, if a geometry is given.
    fn calibration(&self, size: Size) -> Result<Option<Calibration>, Error> {
        if let Some(rectifying) = &self.rectifying {
            return Ok(rectifying.calibration(size));
        }
        Ok(self.geometry.as_ref().map(|geometry| geometry.of(size)).transpose()?)
    }
}

impl Outputs {
    /// Fails if a file could not be written, would overwrite an input or another output, or lacks the data it is made
    /// from. A caller can report this before the work begins.
    ///
    /// # Errors
    /// [`Error::File`], [`Error::Options`].
    pub fn check(&self, making: &Making, inputs: &[&Path]) -> Result<(), Error> {
        let outputs = self.paths(making);
        for (index, output) in outputs.iter().enumerate() {
            making.files.check_writable(output)?;
            inputs.iter().try_for_each(|input| check_distinct(input, output, "is read, and would be overwritten"))?;
            let twice = "would be written twice (beside a map goes MAP.json)";
            outputs[..index].iter().try_for_each(|other| check_distinct(other, output, twice))?;
        }
        self.maps().try_for_each(|map| MapFormat::of(map).map(drop))?;
        self.picture.as_deref().map_or(Ok(()), |picture| check_ending(picture, "a picture", "png"))?;
        self.points.as_deref().map_or(Ok(()), |points| check_ending(points, "a point cloud", "ply"))?;
        let has_geometry = making.geometry.is_some() || making.rectifying.is_some();
        if (self.depth.is_some() || self.points.is_some()) && !has_geometry {
            return Err(Error::Options("depth and points need `calib`, or `focal` and `baseline`".to_owned()));
        }
        Ok(())
    }

    /// Fails if a format cannot hold the disparities of a plan, or if the calibration is for images of another size.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn check_plan(&self, making: &Making, plan: &Plan) -> Result<(), Error> {
        let model = plan.model();
        let [low, high] = [0, model.labels() as u16 - 1].map(|label| model.disparity(label) as f32);
        self.check_map(making, (low, high), plan.image_size())
    }

    /// The same check for a map with disparities from the first to the second value of `range`.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn check_map(&self, making: &Making, range: (f32, f32), size: Size) -> Result<(), Error> {
        self.check_range(making, range.0, range.1)?;
        making.calibration(size).map(drop)
    }

    /// Fails if a format cannot hold disparities from `low` to `high`.
    fn check_range(&self, making: &Making, low: f32, high: f32) -> Result<(), Error> {
        let (low, high) = if making.negate { (-high, -low) } else { (low, high) };
        Ok(self.map.as_deref().map_or(Ok(()), |map| check_range(map, low, high))?)
    }

    /// Writes all files. `watch` receives warnings about their contents.
    ///
    /// # Errors
    /// [`Error::File`]; [`Error::Stopped`] if a pipe had no reader until then, see [`Files::stopping`].
    pub fn write(&self, making: &Making, content: &Content<'_>, watch: &Watch<'_>) -> Result<(), Error> {
        let stopped = |error| if watch.is_stopped() { Error::Stopped } else { error };
        self.write_all(making, content, watch).map_err(stopped)
    }

    fn write_all(&self, making: &Making, content: &Content<'_>, watch: &Watch<'_>) -> Result<(), Error> {
        let plan = content.plan.map(|plan| description::Settings { planned_bytes: None, ..plan.clone() });
        let writer = Writer { making, content, plan, watch };
        self.map.as_deref().map_or(Ok(()), |path| writer.map(path, &making.raster(content.map), None))?;
        self.picture.as_deref().map_or(Ok(()), |path| writer.picture(path))?;
        if let (Some(path), Some(values)) = (&self.confidence, content.confidence) {
            writer.map(
                path,
                &Raster { values, quantity: Quantity::Confidence, ..Raster::disparities(content.map) },
                None,
            )?;
        }
        let Some(calibration) = making.calibration(content.map.size())? else { return Ok(()) };
        self.depth.as_deref().map_or(Ok(()), |path| writer.depth(path, &calibration))?;
        if let (Some(path), Some(image)) = (&self.points, content.image) {
            write_points(&making.files, path, points(content.map, image, &calibration)?)?;
        }
        Ok(())
    }

    /// All files that are written.
    #[must_use]
    pub fn paths(&self, making: &Making) -> Vec<PathBuf> {
        let sidecars =
            self.maps().chain(self.picture.as_deref()).filter(|path| making.has_sidecar(path)).map(sidecar_of);
        let files = [&self.map, &self.picture, &self.depth, &self.points, &self.confidence].into_iter().flatten();
        files.cloned().chain(sidecars).collect()
    }

    /// The files that hold one value per pixel.
    fn maps(&self) -> impl Iterator<Item = &Path> {
        [&self.map, &self.depth, &self.confidence].into_iter().flatten().map(PathBuf::as_path)
    }
}

/// Writes the files of one map.
struct Writer<'a> {
    making: &'a Making,
    content: &'a Content<'a>,
    /// The plan as sidecars hold it.
    plan: Option<description::Settings>,
    watch: &'a Watch<'a>,
}

impl Writer<'_> {
    /// The origin of the maps, for their sidecars.
    fn origin<'b>(&'b self, calibration: Option<&'b Calibration>) -> Origin<'b, description::Settings> {
        let (plan, inputs) = (self.plan.as_ref(), self.content.inputs);
        let labels = |plan: &description::Settings| {
            let first = i64::from(plan.min_disparity);
            [first, first + plan.labels as i64 - 1]
        };
        Origin { plan, labels: plan.map(labels), calibration, inputs }
    }

    /// Writes a map and its sidecar.
    fn map(&self, path: &Path, raster: &Raster<'_>, calibration: Option<&Calibration>) -> Result<(), Error> {
        let raster = &Raster { nan: self.making.nan, ..*raster };
        if raster.range().is_none() {
            self.watch.warn(&format!("{}: no pixel is known", path.display()));
        }
        let files = &self.making.files;
        let map = raster.staged(files, path)?;
        let has_sidecar = self.making.has_sidecar(path);
        let sidecar =
            has_sidecar.then(|| staged_sidecar(files, path, raster, &self.origin(calibration))).transpose()?;
        Ok(put_described(files, path, map, sidecar)?)
    }

    fn picture(&self, path: &Path) -> Result<(), Error> {
        let Making { picture, files, .. } = self.making;
        let staged = picture.staged(files, path, self.content.map)?;
        let raster = Raster::disparities(self.content.map);
        let described = || staged_picture_sidecar(files, path, &raster, picture.colours, &self.origin(None));
        let sidecar = self.making.has_sidecar(path).then(described).transpose()?;
        Ok(put_described(files, path, staged, sidecar)?)
    }

    fn depth(&self, path: &Path, calibration: &Calibration) -> Result<(), Error> {
        let mut depths = depth_map(self.content.map, calibration);
        if MapFormat::of(path)? == MapFormat::Png16 {
            let beyond = |depth: &&mut f32| depth.is_finite() && depth.round() > f32::from(u16::MAX);
            let unknown = depths.iter_mut().filter(beyond).map(|depth| *depth = DisparityMap::UNKNOWN).count();
            if unknown > 0 {
                let what = "pixels are farther than the 65535 mm that a 16-bit PNG holds, and become unknown there";
                self.watch.warn(&format!("{}: {unknown} {what}", path.display()));
            }
        }
        let raster = Raster { values: &depths, quantity: Quantity::Depth, ..Raster::disparities(self.content.map) };
        self.map(path, &raster, Some(calibration))
    }
}
