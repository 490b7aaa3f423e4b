//! Resamples the images of two cameras.

use fearless_simd::{Level, Simd, dispatch};
use rayon::prelude::*;

use super::{camera::Rig, view::Rectification};
use crate::{Calibration, Error, Image, Size, StereoPair, memory::Buffer};

/// Positions are kept in parts of a pixel.
const PARTS: f64 = 256.0;

/// The position of a pixel that no camera shows.
const NOWHERE: [u32; 2] = [u32::MAX; 2];

/// Turns pairs of raw images into rectified pairs. It is prepared once for a rig.
#[derive(Clone, Debug)]
pub struct Rectifier {
    rectification: Rectification,
    calibration: Calibration,
    /// The size of the raw images.
    raw: Size,
    /// For each image, where its pixels come from: column and row in 1 / `PARTS` of a pixel, `[height][width]`.
    positions: [Buffer<[u32; 2]>; 2],
}

impl Rectifier {
    /// Prepares a rectification of a rig, for example [`Rectification::of`].
    ///
    /// # Errors
    /// [`Error::Calibration`] if the rectified images are no pair, [`Error::TooLarge`] and [`Error::Empty`] for their size,
    /// [`Error::OutOfMemory`].
    pub fn new(rig: &Rig, rectification: Rectification) -> Result<Self, Error> {
        let calibration = rectification.calibration()?;
        let positions = [positions(rig, &rectification, 0)?, positions(rig, &rectification, 1)?];
        Ok(Self { rectification, calibration, raw: rig.cameras[0].size, positions })
    }

    /// The bytes that it holds, for rectified images of so many pixels.
    #[must_use]
    pub fn bytes(pixels: usize) -> u64 {
        2 * (size_of::<[u32; 2]>() * pixels) as u64
    }

    /// The rotations and the view.
    #[must_use]
    pub fn rectification(&self) -> &Rectification {
        &self.rectification
    }

    /// The geometry of the rectified pairs.
    #[must_use]
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// Rectifies a pair, by linear interpolation. Pixels that a camera does not show are black.
    ///
    /// # Errors
    /// [`Error::WrongSize`] if an image has not the size that the calibration is for, [`Error::OutOfMemory`].
    pub fn rectified(&self, left: &Image, right: &Image) -> Result<StereoPair, Error> {
        for (what, image) in [("the left image", left), ("the right image", right)] {
            if image.size() != self.raw {
                return Err(Error::WrongSize { what, found: image.size(), expected: self.raw });
            }
        }
        StereoPair::new(self.resampled(0, left)?, self.resampled(1, right)?)
    }

    /// Where a pixel of the left (0) or right (1) rectified image comes from: column and row of the raw image. `None` if the
    /// camera does not show it.
    #[must_use]
    pub fn source(&self, index: usize, x: usize, y: usize) -> Option<[f64; 2]> {
        let position = *self.positions.get(index)?.get(y * self.rectification.size.width + x)?;
        (position != NOWHERE).then(|| position.map(|side| f64::from(side) / PARTS))
    }

    fn resampled(&self, index: usize, image: &Image) -> Result<Image, Error> {
        let (size, level) = (self.rectification.size, Level::new());
        let mut pixels = Buffer::filled("a rectified image", size.pixels(), [0; 3])?;
        let rows = pixels.par_chunks_exact_mut(size.width).zip(self.positions[index].par_chunks_exact(size.width));
        rows.for_each(|(row, positions)| dispatch!(level, simd => resample(simd, image, positions, row)));
        Image::of_colours(size.width, size.height, pixels)
    }
}

/// Pixels that are interpolated together.
const TOGETHER: usize = 16;

/// The pixels around some positions, and how far each position is from the first of its four: to the right and down.
struct Around {
    /// Colours as the low bytes of an integer; of the pixel itself, to the right, below, and both.
    corners: [[u32; TOGETHER]; 4],
    parts: [[u32; TOGETHER]; 2],
}

impl Around {
    /// Black where a position is nowhere.
    #[inline(always)]
    fn of(image: &Image, positions: &[[u32; 2]]) -> Self {
        let (mut around, width) = (Self { corners: [[0; TOGETHER]; 4], parts: [[0; TOGETHER]; 2] }, image.size().width);
        let (greys, colours) = (image.greys(), image.colours());
        let colour = |at: usize| match colours {
            Some(colours) => colours.get(at).map_or(0, |&[red, green, blue]| u32::from_le_bytes([red, green, blue, 0])),
            None => greys.get(at).map_or(0, |&grey| u32::from_le_bytes([grey, grey, grey, 0])),
        };
        for (i, &position) in positions.iter().enumerate().filter(|(_, position)| **position != NOWHERE) {
            let [(x, right), (y, below)] = position.map(|side| ((side >> 8) as usize, side & 0xff));
            let at = y * width + x;
            // The last column and row have no neighbour, and no weight for one: any colour will do.
            for (corner, at) in around.corners.iter_mut().zip([at, at + 1, at + width, at + width + 1]) {
                corner[i] = colour(at);
            }
            (around.parts[0][i], around.parts[1][i]) = (right, below);
        }
        around
    }

    /// The colours between the four pixels.
    #[inline(always)]
    fn mixed(&self) -> [u32; TOGETHER] {
        let mut mixed = [0; TOGETHER];
        for (i, mixed) in mixed.iter_mut().enumerate() {
            let [right, below] = [self.parts[0][i], self.parts[1][i]];
            let weights = [(256 - right) * (256 - below), right * (256 - below), (256 - right) * below, right * below];
            for shift in [0, 8, 16] {
                let channel = |corner: usize| weights[corner] * (self.corners[corner][i] >> shift & 0xff);
                let sum = channel(0) + channel(1) + channel(2) + channel(3);
                *mixed |= (sum + (1 << 15)) >> 16 << shift;
            }
        }
        mixed
    }
}

/// Writes the colours at positions of a raw image.
#[inline(always)]
fn resample<S: Simd>(simd: S, image: &Image, positions: &[[u32; 2]], row: &mut [[u8; 3]]) {
    simd.vectorize(
        #[inline(always)]
        || {
            for (row, positions) in row.chunks_mut(TOGETHER).zip(positions.chunks(TOGETHER)) {
                let mixed = Around::of(image, positions).mixed();
                for (pixel, colour) in row.iter_mut().zip(mixed) {
                    let [red, green, blue, _] = colour.to_le_bytes();
                    *pixel = [red, green, blue];
                }
            }
        },
    );
}

/// Where the pixels of one rectified image come from.
fn positions(rig: &Rig, rectification: &Rectification, index: usize) -> Result<Buffer<[u32; 2]>, Error> {
    let size = Size::new(rectification.size.width, rectification.size.height)?;
    let (camera, ray) = (rig.cameras[index], rectification.ray(index));
    let position = |pixel: [f64; 2]| {
        let [column, row] = camera.pixel(ray(pixel))?.map(|side| libm::floor(side * PARTS + 0.5));
        let [right, bottom] = [camera.size.width, camera.size.height].map(|side| (side - 1) as f64 * PARTS);
        ((0.0..=right).contains(&column) && (0.0..=bottom).contains(&row)).then_some([column as u32, row as u32])
    };
    let mut positions = Buffer::filled("the positions of rectified pixels", size.pixels(), NOWHERE)?;
    positions.par_chunks_exact_mut(size.width).enumerate().for_each(|(y, row)| {
        for (x, found) in row.iter_mut().enumerate() {
            *found = position([x as f64, y as f64]).unwrap_or(NOWHERE);
        }
    });
    Ok(positions)
}
