//! `bp convert`: makes other files from an existing disparity map.

use std::path::{Path, PathBuf};

use bp_core::{DisparityMap, Image};
use bp_io::{Limits, read_image, read_map};
use bp_stereo::{Content, reading_limits};

use crate::{args::ConvertArgs, failure::Failure, interrupt, terminal};

/// Runs the command.
pub(crate) fn convert(args: &ConvertArgs) -> Result<(), Failure> {
    let making = args.outputs.making(false, false, false)?;
    let outputs = args.outputs.outputs(args.output.as_deref());
    if outputs.paths(&making).is_empty() {
        return Err(Failure::usage("nothing to write: give --output, --picture, --depth or --points"));
    }
    if outputs.points.is_some() && args.image.is_none() {
        return Err(Failure::usage("--points needs --image, the left image, for its colours"));
    }
    if outputs.points.is_none() && args.image.is_some() {
        return Err(Failure::usage("--image is for --points: give --points too"));
    }
    let images = [Some(&args.map), args.image.as_ref()].into_iter().flatten();
    let inputs: Vec<&Path> = images.chain(args.outputs.calibration()).map(PathBuf::as_path).collect();
    outputs.check(&making, &inputs)?;
    let limit = reading_limits(args.max_megapixels);
    let map = read_map(&args.map, args.map_scale, limit)?;
    outputs.check_map(&making, map.range().unwrap_or((0.0, 0.0)), map.size())?;
    let image = args.image.as_deref().map(|path| read_image_of(&map, path, limit)).transpose()?;
    // Only now: what reads can be stopped at any moment, and a read from a pipe may wait for ever.
    interrupt::listen()?;
    let watch = terminal::watch();
    let content = Content { map: &map, confidence: None, image: image.as_ref(), plan: None, inputs: &inputs };
    Ok(outputs.write(&making, &content, &watch)?)
}

/// Reads the left image of a map.
fn read_image_of(map: &DisparityMap, path: &Path, limit: Limits) -> Result<Image, Failure> {
    let image = read_image(path, limit)?;
    if image.size() == map.size() {
        return Ok(image);
    }
    let (found, size) = (image.size(), map.size());
    Err(Failure::input(format!("{}: {found} pixels, but the map has {size}", path.display())))
}
