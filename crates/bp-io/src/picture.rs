//! Coloured pictures of disparity maps.

use std::{io::Write, ops::RangeInclusive, path::Path};

use bp_core::{DisparityMap, Size};
use image::{ExtendedColorType, ImageEncoder, ImageError, codecs::png::PngEncoder};

use crate::{Colours, Error, Files, Staged};

/// The colour of unknown pixels.
const UNKNOWN: [u8; 3] = [0; 3];

/// A picture in memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pixels {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Red, green and blue, `[height][width]`.
    pub colours: Vec<[u8; 3]>,
}

/// The colour bar beside a picture, which shows the disparities of its colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColourBar {
    /// Disparity of the lower end in pixels.
    pub low: f32,
    /// Disparity of the upper end in pixels.
    pub high: f32,
    /// Height of the picture in pixels.
    pub height: u32,
    /// The colours.
    pub colours: Colours,
}

/// Draws a colour bar, or returns why it cannot. Its text needs a font, so the program supplies this function.
pub type DrawBar = fn(&ColourBar) -> Result<Pixels, String>;

/// How a picture of a map looks.
#[derive(Clone, Copy, Debug, Default)]
pub struct Picture {
    /// The colours of known pixels.
    pub colours: Colours,
    /// Draws the colour bar beside the map. `None` makes a picture with the size of the map.
    pub bar: Option<DrawBar>,
}

impl Picture {
    /// Writes a map as a coloured PNG over its own range, see [`Files::staged`]. A map without known pixels gets no bar, nor does
    /// one so narrow or low that most of the picture would be the bar and white.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub fn staged(self, files: &Files, path: &Path, map: &DisparityMap) -> Result<Staged, Error> {
        let (low, high) = map.range().unwrap_or((0.0, 1.0));
        let mut picture = coloured(map, low..=high, self.colours);
        if let Some(draw) = self.bar.filter(|_| map.range().is_some() && has_room(map.size())) {
            let bar = ColourBar { low, high, height: picture.height, colours: self.colours };
            picture = beside(&picture, &draw(&bar).map_err(|error| Error::writing(path, &error))?);
        }
        files.staged(path, |file| encode(file, &picture))
    }
}

/// Whether a bar makes the picture of a map larger by two thirds at most, or leaves it small. Limits of memory count on that.
fn has_room(map: Size) -> bool {
    const BAR: Size = Size { width: 512, height: 72 };
    const SMALL: usize = 2 << 20;
    let with_bar = (map.width + BAR.width).saturating_mul(map.height.max(BAR.height));
    with_bar <= SMALL || with_bar <= map.pixels() / 3 * 5
}

/// Encodes a map as a coloured PNG: the near end of `range` is bright, the far end dark, and unknown pixels are black.
///
/// # Errors
/// Those of the encoder, and of writing.
pub fn encode_picture(file: &mut dyn Write, map: &DisparityMap, range: RangeInclusive<f32>) -> Result<(), ImageError> {
    encode(file, &coloured(map, range, Colours::Viridis))
}

pub(crate) fn coloured(map: &DisparityMap, range: RangeInclusive<f32>, colours: Colours) -> Pixels {
    let (low, high) = (f64::from(*range.start()), f64::from(*range.end()));
    let place = |value: f32| if low < high { (f64::from(value) - low) / (high - low) } else { 0.5 };
    let pixel = |&value: &f32| if value.is_finite() { colours.at(place(value)) } else { UNKNOWN };
    let Size { width, height } = map.size();
    Pixels { width: width as u32, height: height as u32, colours: map.values().iter().map(pixel).collect() }
}

/// Two pictures side by side, aligned at the top, on white.
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

#[cfg(test)]
mod tests {
    use super::*;

    fn bar(bar: &ColourBar) -> Result<Pixels, String> {
        let height = bar.height.clamp(72, 4096);
        Ok(Pixels { width: 100, height, colours: vec![[9; 3]; 100 * height as usize] })
    }

    #[test]
    fn narrow_and_low_maps_get_no_bar_that_takes_more_memory_than_they_do() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.png");
        let written = |width: usize, height: usize| {
            let map = DisparityMap::new(Size { width, height }, vec![3.0; width * height]).unwrap();
            let picture = Picture { bar: Some(bar), ..Picture::default() };
            picture.staged(&Files::default(), &path, &map).and_then(Staged::put).unwrap();
            image::image_dimensions(&path).unwrap()
        };
        assert_eq!([written(1, 300_000), written(300_000, 1)], [(1, 300_000), (300_000, 1)]);
        assert_eq!([written(640, 480), written(1, 1), written(1500, 1200)], [(740, 480), (101, 72), (1600, 1200)]);
    }
}
