//! The files that are made of a map.

use std::path::{Path, PathBuf};

use bp_core::{Calibration, DisparityMap, Image, Model, Size, depth_map, points};

use crate::{
    args::OutputArgs,
    failure::Failure,
    files::{
        Colours, Geometry, MapFormat, Origin, Picture, Quantity, Raster, check_distinct, check_ending, check_range,
        check_writable, remove_sidecar, sidecar_of, write_picture_sidecar, write_points, write_sidecar,
    },
    record, warn,
};

/// Where the files of one map go.
#[derive(Clone, Debug, Default)]
pub(crate) struct Outputs {
    /// The disparity map.
    pub(crate) map: Option<PathBuf>,
    /// A coloured picture of it.
    pub(crate) picture: Option<PathBuf>,
    /// A depth map.
    pub(crate) depth: Option<PathBuf>,
    /// A point cloud.
    pub(crate) points: Option<PathBuf>,
    /// How far the map can be trusted.
    pub(crate) confidence: Option<PathBuf>,
}

/// How files are made, the same for every pair.
#[derive(Clone, Debug)]
pub(crate) struct Making {
    picture: Picture,
    sidecar: bool,
    geometry: Option<Geometry>,
}

/// What files are made of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Content<'a> {
    /// The map.
    pub(crate) map: &'a DisparityMap,
    /// How far it can be trusted, `[height][width]`.
    pub(crate) confidence: Option<&'a [f32]>,
    /// The left image, where points take its colours.
    pub(crate) image: Option<&'a Image>,
    /// What was matched, where it was.
    pub(crate) plan: Option<&'a record::Settings>,
    /// The files that the map was made of.
    pub(crate) inputs: &'a [&'a Path],
}

impl Making {
    /// What the options ask for.
    pub(crate) fn of(outputs: &OutputArgs) -> Result<Self, Failure> {
        check_used(outputs)?;
        let args = &outputs.making;
        let given = args.focal.zip(args.baseline).map(|(focal, baseline)| Geometry {
            focal,
            baseline,
            doffs: args.doffs.unwrap_or(0.0),
            principal_point: args.principal_point,
            file: None,
        });
        let read = args.calib.as_deref().map(Geometry::read).transpose()?;
        let picture = Picture { colours: args.colours.unwrap_or(Colours::ALL[0]), bar: !args.no_colour_bar };
        Ok(Self { picture, sidecar: !args.no_sidecar, geometry: read.or(given) })
    }

    /// The same, wherever a calibration was read from.
    pub(crate) fn unnamed(&self) -> Self {
        let unnamed = |(_, size)| (PathBuf::new(), size);
        let geometry = self.geometry.clone().map(|read| Geometry { file: read.file.map(unnamed), ..read });
        Self { geometry, ..self.clone() }
    }

    /// The geometry of images of some size, where an option gives one.
    fn calibration(&self, size: Size) -> Result<Option<Calibration>, Failure> {
        self.geometry.as_ref().map(|geometry| geometry.of(size)).transpose()
    }
}

impl Outputs {
    /// What the options ask for, beside a map.
    pub(crate) fn of(map: Option<&Path>, args: &OutputArgs) -> Self {
        let OutputArgs { picture, depth, points, .. } = args;
        let [picture, depth, points] = [picture, depth, points].map(Clone::clone);
        Self { map: map.map(Into::into), picture, depth, points, confidence: None }
    }

    /// Fails where a file could not be written, would overwrite an input or another output, or lacks what it is made of;
    /// for telling so before the work is done.
    pub(crate) fn check(&self, making: &Making, inputs: &[&Path]) -> Result<(), Failure> {
        let outputs = self.paths(making);
        for (index, output) in outputs.iter().enumerate() {
            check_writable(output)?;
            inputs.iter().try_for_each(|input| check_distinct(input, output, "is read, and would be overwritten"))?;
            let twice = "would be written twice (beside a map goes MAP.json)";
            outputs[..index].iter().try_for_each(|other| check_distinct(other, output, twice))?;
        }
        self.maps().try_for_each(|map| MapFormat::of(map).map(drop))?;
        self.picture.as_deref().map_or(Ok(()), |picture| check_ending(picture, "a picture", "png"))?;
        self.points.as_deref().map_or(Ok(()), |points| check_ending(points, "a point cloud", "ply"))?;
        if (self.depth.is_some() || self.points.is_some()) && making.geometry.is_none() {
            return Err(Failure::usage("--depth and --points need --calib, or --focal and --baseline"));
        }
        Ok(())
    }

    /// Fails where a format cannot hold the disparities of a model, or the calibration is for images of another size.
    pub(crate) fn check_model(&self, making: &Making, model: &Model, size: Size) -> Result<(), Failure> {
        let [low, high] = [0, model.labels() as u16 - 1].map(|label| model.disparity(label) as f32);
        self.check_map(making, (low, high), size)
    }

    /// The same for a map of disparities from the first to the second of `range`.
    pub(crate) fn check_map(&self, making: &Making, range: (f32, f32), size: Size) -> Result<(), Failure> {
        self.check_range(range.0, range.1)?;
        making.calibration(size).map(drop)
    }

    /// Fails where a format cannot hold disparities from `low` to `high`.
    fn check_range(&self, low: f32, high: f32) -> Result<(), Failure> {
        self.map.as_deref().map_or(Ok(()), |map| check_range(map, low, high))
    }

    /// Whether the formats can hold a disparity.
    pub(crate) fn hold(&self, disparity: i32) -> bool {
        self.check_range(disparity as f32, disparity as f32).is_ok()
    }

    /// Writes all files.
    pub(crate) fn write(&self, making: &Making, content: &Content<'_>) -> Result<(), Failure> {
        let disparities = Raster::disparities(content.map);
        self.map.as_deref().map_or(Ok(()), |path| write_map(path, &disparities, making, content, None))?;
        self.picture.as_deref().map_or(Ok(()), |path| write_picture(path, making, content))?;
        if let (Some(path), Some(values)) = (&self.confidence, content.confidence) {
            let raster = Raster { size: content.map.size(), values, quantity: Quantity::Confidence };
            write_map(path, &raster, making, content, None)?;
        }
        let Some(calibration) = making.calibration(content.map.size())? else { return Ok(()) };
        self.depth.as_deref().map_or(Ok(()), |path| write_depth(path, making, content, &calibration))?;
        match (&self.points, content.image) {
            (Some(path), Some(image)) => write_points(path, points(content.map, image, &calibration)?),
            _ => Ok(()),
        }
    }

    /// All files that are written.
    pub(crate) fn paths(&self, making: &Making) -> Vec<PathBuf> {
        let sidecars = self.maps().chain(self.picture.as_deref()).filter(|_| making.sidecar).map(sidecar_of);
        let files = [&self.map, &self.picture, &self.depth, &self.points, &self.confidence].into_iter().flatten();
        files.cloned().chain(sidecars).collect()
    }

    /// The files that hold a value a pixel.
    fn maps(&self) -> impl Iterator<Item = &Path> {
        [&self.map, &self.depth, &self.confidence].into_iter().flatten().map(PathBuf::as_path)
    }
}

/// Refuses options of files that are not asked for.
fn check_used(OutputArgs { picture, depth, points, making }: &OutputArgs) -> Result<(), Failure> {
    if picture.is_none() && (making.colours.is_some() || making.no_colour_bar) {
        let what = "--colours and --no-colour-bar are for a picture";
        return Err(Failure::usage(format!("{what}: give --picture too (of many pairs, --also picture)")));
    }
    if depth.is_none() && points.is_none() && (making.calib.is_some() || making.focal.is_some()) {
        let what = "--calib and --focal are for depth and points";
        return Err(Failure::usage(format!(
            "{what}: give --depth or --points too (of many pairs, --also depth,points)"
        )));
    }
    Ok(())
}

/// Writes a map, and what tells of it.
fn write_map(
    path: &Path,
    raster: &Raster<'_>,
    making: &Making,
    content: &Content<'_>,
    calibration: Option<&Calibration>,
) -> Result<(), Failure> {
    // What is told of the map before it must not stand beside the new one, even where this ends in between.
    remove_sidecar(path)?;
    if raster.range().is_none() {
        warn(&format!("{}: nothing is known of any pixel", path.display()));
    }
    raster.write(path)?;
    let origin = Origin { plan: content.plan, calibration, inputs: content.inputs };
    if making.sidecar { write_sidecar(path, raster, &origin) } else { Ok(()) }
}

fn write_picture(path: &Path, making: &Making, content: &Content<'_>) -> Result<(), Failure> {
    remove_sidecar(path)?;
    making.picture.write(path, content.map)?;
    let origin = Origin { plan: content.plan, calibration: None, inputs: content.inputs };
    let raster = Raster::disparities(content.map);
    if making.sidecar { write_picture_sidecar(path, &raster, making.picture.colours, &origin) } else { Ok(()) }
}

fn write_depth(path: &Path, making: &Making, content: &Content<'_>, calibration: &Calibration) -> Result<(), Failure> {
    let mut depths = depth_map(content.map, calibration);
    if MapFormat::of(path)? == MapFormat::Png16 {
        let beyond = |depth: &&mut f32| depth.is_finite() && depth.round() > f32::from(u16::MAX);
        let unknown = depths.iter_mut().filter(beyond).map(|depth| *depth = DisparityMap::UNKNOWN).count();
        if unknown > 0 {
            let what = "pixels are farther than the 65535 mm that a 16-bit PNG holds, and unknown there";
            warn(&format!("{}: {unknown} {what}", path.display()));
        }
    }
    let raster = Raster { size: content.map.size(), values: &depths, quantity: Quantity::Depth };
    write_map(path, &raster, making, content, Some(calibration))
}
