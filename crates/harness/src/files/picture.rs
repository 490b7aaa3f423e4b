//! Coloured pictures of disparity maps.

use std::{io::Write, ops::RangeInclusive, path::Path};

use bp_charts::{ColourBar, Pixels};
use bp_core::{DisparityMap, Size};
use image::{ExtendedColorType, ImageEncoder, ImageError, codecs::png::PngEncoder};

use super::{Colours, write_whole};
use crate::failure::Failure;

/// The colour of unknown pixels.
const UNKNOWN: [u8; 3] = [0; 3];

/// How a picture of a map looks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Picture {
    /// The colours of known pixels.
    pub(crate) colours: Colours,
    /// Whether a bar beside it tells which disparities they stand for.
    pub(crate) bar: bool,
}

impl Picture {
    /// Writes a map as a coloured PNG over its own range; a map without known pixels has no bar.
    pub(crate) fn write(self, path: &Path, map: &DisparityMap) -> Result<(), Failure> {
        let range = map.range();
        let (low, high) = range.unwrap_or((0.0, 1.0));
        let mut picture = coloured(map, low..=high, self.colours);
        if self.bar && range.is_some() {
            let bar = ColourBar { low: low.into(), high: high.into(), unit: "px", height: picture.height };
            let bar = bar.draw(|place| self.colours.at(place)).map_err(|error| Failure::writing(path, &error))?;
            picture = beside(&picture, &bar);
        }
        write_whole(path, |file| encode(file, &picture))
    }
}

/// Encodes a map as a coloured PNG: the near end of `range` bright, the far end dark, unknown black.
pub(crate) fn encode_picture(
    file: &mut dyn Write,
    map: &DisparityMap,
    range: RangeInclusive<f32>,
) -> Result<(), ImageError> {
    encode(file, &coloured(map, range, Colours::Viridis))
}

fn coloured(map: &DisparityMap, range: RangeInclusive<f32>, colours: Colours) -> Pixels {
    let (low, high) = (f64::from(*range.start()), f64::from(*range.end()));
    let place = |value: f32| if low < high { (f64::from(value) - low) / (high - low) } else { 0.5 };
    let pixel = |&value: &f32| if value.is_finite() { colours.at(place(value)) } else { UNKNOWN };
    let Size { width, height } = map.size();
    Pixels { width: width as u32, height: height as u32, colours: map.values().iter().map(pixel).collect() }
}

/// Two pictures side by side from the top, on white.
fn beside(left: &Pixels, right: &Pixels) -> Pixels {
    let (width, height) = (left.width + right.width, left.height.max(right.height));
    let row = |picture: &Pixels, y: u32| -> Vec<[u8; 3]> {
        let begin = y as usize * picture.width as usize;
        picture
            .colours
            .get(begin..begin + picture.width as usize)
            .map_or_else(|| vec![[255; 3]; picture.width as usize], Vec::from)
    };
    let mut colours = Vec::with_capacity(width as usize * height as usize);
    colours.extend((0..height).flat_map(|y| [row(left, y), row(right, y)]).flatten());
    Pixels { width, height, colours }
}

fn encode(file: &mut dyn Write, picture: &Pixels) -> Result<(), ImageError> {
    let bytes = picture.colours.as_flattened();
    PngEncoder::new(file).write_image(bytes, picture.width, picture.height, ExtendedColorType::Rgb8)
}
