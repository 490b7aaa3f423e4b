//! Maps that are written one after another.

use bp_core::{DisparityMap, Size};
use y4m::{Colorspace, Frame, Ratio};

use crate::{Colours, MapFormat, Raster, picture::coloured};

/// How the maps of a video follow one another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameFormat {
    /// One PFM file after another.
    Pfm,
    /// One NumPy file after another.
    Npy {
        /// Whether unknown pixels are NaN, and not plus infinity.
        nan: bool,
    },
    /// A YUV4MPEG2 video of coloured pictures (4:4:4, 8 bits).
    Y4m(Colours),
}

impl FrameFormat {
    /// The extensions of the formats.
    pub const EXTENSIONS: [&str; 3] = ["pfm", "npy", "y4m"];

    /// Encodes the map of a frame. `range` is that of the colours in pixels, from far to near, and `rate` the frames per second as a fraction.
    /// Only the first map of a video has the video's header.
    ///
    /// # Errors
    /// Those of the encoder, as text.
    pub fn encode(
        self,
        map: &DisparityMap,
        range: [f32; 2],
        rate: [usize; 2],
        is_first: bool,
    ) -> Result<Vec<u8>, String> {
        let floats = |format, nan| Raster { nan, ..Raster::disparities(map) }.floats(format);
        let encoded = match self {
            Self::Pfm => floats(MapFormat::Pfm, false),
            Self::Npy { nan } => floats(MapFormat::Npy, nan),
            Self::Y4m(colours) => {
                let encoded = video(map, range, rate, colours).map_err(|error| error.to_string());
                Some(encoded.map(|bytes| if is_first { bytes } else { without_header(bytes) }))
            }
        };
        encoded.unwrap_or_else(|| Ok(Vec::new()))
    }
}

/// A video of one frame.
fn video(map: &DisparityMap, [low, high]: [f32; 2], rate: [usize; 2], colours: Colours) -> Result<Vec<u8>, y4m::Error> {
    let Size { width, height } = map.size();
    let pixels = coloured(map, low..=high, colours).colours;
    let plane = |channel: usize| pixels.iter().map(|&rgb| ycbcr(rgb)[channel]).collect::<Vec<u8>>();
    let planes = [plane(0), plane(1), plane(2)];
    let mut bytes = Vec::new();
    let encoder = y4m::encode(width, height, Ratio::new(rate[0], rate[1])).with_colorspace(Colorspace::C444);
    encoder.write_header(&mut bytes)?.write_frame(&Frame::new([&planes[0], &planes[1], &planes[2]], None))?;
    Ok(bytes)
}

/// The frame of such a video. Its header is a line.
fn without_header(mut bytes: Vec<u8>) -> Vec<u8> {
    let end = bytes.iter().position(|&byte| byte == b'\n').map_or(0, |end| end + 1);
    bytes.split_off(end)
}

/// Luma from 16 to 235 and both colour differences around 128 (ITU-R BT.601, in 1/256), which programs assume for videos.
fn ycbcr(rgb: [u8; 3]) -> [u8; 3] {
    const WEIGHTS: [([i32; 3], i32); 3] = [([66, 129, 25], 16), ([-38, -74, 112], 128), ([112, -94, -18], 128)];
    WEIGHTS.map(|(weights, zero)| {
        let sum: i32 = weights.iter().zip(rgb).map(|(weight, channel)| weight * i32::from(channel)).sum();
        (((sum + 128) >> 8) + zero) as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grey_levels_and_pure_colours_have_the_values_of_the_standard() {
        // ITU-R BT.601-7, table of 8-bit values for colour bars at full amplitude; rounded weights may be off by one.
        let bars = [
            ([255, 255, 255], [235, 128, 128]),
            ([255, 0, 0], [81, 90, 240]),
            ([0, 255, 0], [145, 54, 34]),
            ([0, 0, 255], [41, 240, 110]),
            ([0, 0, 0], [16, 128, 128]),
        ];
        for (rgb, expected) in bars {
            let near = ycbcr(rgb).iter().zip(expected).all(|(&found, expected)| found.abs_diff(expected) <= 1);
            assert!(near, "{rgb:?} became {:?}", ycbcr(rgb));
        }
    }
}
