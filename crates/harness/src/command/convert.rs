//! `bp convert`: other files of a disparity map that is there.

use std::path::{Path, PathBuf};

use bp_core::{DisparityMap, Image};

use crate::{
    args::ConvertArgs,
    failure::Failure,
    files::{PixelLimit, read_image, read_map},
    interrupt,
    matching::{Content, Making, Outputs},
};

/// Runs the command.
pub(crate) fn convert(args: &ConvertArgs) -> Result<(), Failure> {
    let making = Making::of(&args.outputs)?;
    let outputs = Outputs::of(args.output.as_deref(), &args.outputs);
    if outputs.paths(&making).is_empty() {
        return Err(Failure::usage("nothing to write: give --output, --picture, --depth or --points"));
    }
    if outputs.points.is_some() && args.image.is_none() {
        return Err(Failure::usage("--points needs --image, the left image that its colours come from"));
    }
    if outputs.points.is_none() && args.image.is_some() {
        return Err(Failure::usage("--image is for --points: give --points too"));
    }
    interrupt::listen()?;
    let calib = &args.outputs.making.calib;
    let inputs: Vec<&Path> =
        [Some(&args.map), args.image.as_ref(), calib.as_ref()].into_iter().flatten().map(PathBuf::as_path).collect();
    outputs.check(&making, &inputs)?;
    let limit = PixelLimit::megapixels(args.max_megapixels);
    let map = read_map(&args.map, args.map_scale, limit)?;
    outputs.check_map(&making, map.range().unwrap_or((0.0, 0.0)), map.size())?;
    let image = args.image.as_deref().map(|path| read_image_of(&map, path, limit)).transpose()?;
    interrupt::check()?;
    outputs.write(&making, &Content { map: &map, confidence: None, image: image.as_ref(), plan: None, inputs: &inputs })
}

/// Reads the left image of a map.
fn read_image_of(map: &DisparityMap, path: &Path, limit: PixelLimit) -> Result<Image, Failure> {
    let image = read_image(path, limit)?;
    if image.size() == map.size() {
        return Ok(image);
    }
    let (found, size) = (image.size(), map.size());
    Err(Failure::input(format!("{}: {found} pixels where the map has {size}", path.display())))
}
