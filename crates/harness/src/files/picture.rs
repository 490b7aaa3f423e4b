//! Coloured pictures of disparity maps.

use std::{io::Write, ops::RangeInclusive, path::Path};

use bp_core::{DisparityMap, Size};
use image::{ExtendedColorType, ImageEncoder, ImageError, codecs::png::PngEncoder};
use plotters::style::colors::colormaps::{ColorMap, ViridisRGB};

use super::write_whole;
use crate::failure::Failure;

/// The colour of a value at `place` in 0..=1 of the range: viridis, which colour-blind readers and grey printers keep
/// in order.
pub(crate) fn colour(place: f32) -> [u8; 3] {
    let colour = ViridisRGB.get_color(place.clamp(0.0, 1.0));
    [colour.0, colour.1, colour.2]
}

/// Encodes a map as a coloured PNG: the near end of `range` bright, the far end dark, unknown black.
pub(crate) fn encode_picture(
    file: &mut dyn Write,
    map: &DisparityMap,
    range: RangeInclusive<f32>,
) -> Result<(), ImageError> {
    let width = (range.end() - range.start()).max(f32::MIN_POSITIVE);
    let pixel = |&value: &f32| if value.is_finite() { colour((value - range.start()) / width) } else { [0; 3] };
    let bytes: Vec<u8> = map.values().iter().flat_map(pixel).collect();
    let Size { width, height } = map.size();
    PngEncoder::new(file).write_image(&bytes, width as u32, height as u32, ExtendedColorType::Rgb8)
}

/// Writes a map as a coloured PNG over its own range.
pub(crate) fn write_picture(path: &Path, map: &DisparityMap) -> Result<(), Failure> {
    let (low, high) = map.range().unwrap_or((0.0, 1.0));
    write_whole(path, |file| encode_picture(file, map, low..=high))
}
