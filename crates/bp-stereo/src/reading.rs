//! Reads the images of pairs, within the memory that is free or allowed.

use std::path::Path;

use bp_core::{
    DeviceKind, Image, Size, StereoPair,
    image::{Samples, Stretch},
};
use bp_io::{Contents, Limits, parse_samples, read_image};

use crate::{Error, Memory, Options, Rectifying, memory::PROGRAM, rectifying::POSITIONS};

/// Bytes per raw pixel while a pair is rectified: the rectified pair, and the positions of its pixels.
const RECTIFYING: u64 = 2 * Image::COLOUR_BYTES + POSITIONS;

/// Bytes per pixel while values are stretched: the pair, and which pixels are valid.
const STRETCHING: u64 = 2 * Image::COLOUR_BYTES + 1;

/// How reading needs less memory.
const IMAGES: &str = "use smaller images";
const LIST: &str = "split the list";

/// Bytes that may be read in any case: the threads and outputs that [`PROGRAM`] counts are not there yet. So small images
/// are refused when their plan is known, with advice that suits it.
const SMALL: u64 = 4 << 20;

/// Calls `read` with the limits for a file that the program reads beside `taken` bytes in memory: those of its pixels, and the
/// memory that is free or, if `max_memory` is given, allowed.
///
/// # Errors
/// That of `read`. A lack of memory is explained.
pub fn read_beside<T>(
    taken: u64,
    max_megapixels: u32,
    max_memory: Option<u64>,
    read: impl FnOnce(Limits) -> Result<T, bp_io::Error>,
) -> Result<T, Error> {
    let room = Room::new(max_megapixels, max_memory).without(taken);
    room.explained(read(room.limits))
}

/// The limits for files of so many megapixels within the free memory.
#[must_use]
pub fn reading_limits(max_megapixels: u32) -> Limits {
    Room::new(max_megapixels, None).limits
}

/// Reads the two images of a pair. The program stays within `max_memory` bytes, if they are given.
///
/// # Errors
/// [`Error::File`], [`Error::OutOfMemory`], [`Error::Core`] if the sizes differ.
pub fn read_pair(images: [&Path; 2], max_megapixels: u32, max_memory: Option<u64>) -> Result<StereoPair, Error> {
    Room::new(max_megapixels, max_memory).pair(images, None, |room, path| room.explained(read_image(path, room.limits)))
}

/// As [`read_pair`], for raw images, which are then rectified.
///
/// # Errors
/// Those of [`read_pair`] and of [`Rectifying::rectified`].
pub fn read_raw_pair(
    images: [&Path; 2],
    rectifying: &Rectifying,
    max_megapixels: u32,
    max_memory: Option<u64>,
) -> Result<StereoPair, Error> {
    let read = |room: Room, path: &Path| room.explained(read_image(path, room.limits));
    Room::new(max_megapixels, max_memory).pair(images, Some(rectifying), read)
}

/// A pair as it was read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReadPair {
    /// The images.
    pub pair: StereoPair,
    /// The pixels of the left image that have a value, `[height][width]`; `None` if all have. A map should be restricted to them,
    /// see [`Disparity::restrict`](crate::Disparity::restrict).
    pub valid: Option<Vec<bool>>,
}

impl ReadPair {
    /// A pair whose values have any range. One scale for both images makes their 0.5 % darkest values black and their 0.5 % brightest white.
    /// Missing values, which are not finite, become black.
    ///
    /// # Errors
    /// [`bp_core::Error::SizesDiffer`], [`bp_core::Error::OutOfMemory`].
    pub fn stretched(left: Samples, right: Samples) -> Result<Self, bp_core::Error> {
        let (stretch, valid) = (Stretch::of(&[&left, &right]), left.valid());
        Ok(Self { pair: StereoPair::new(left.stretched(&stretch)?, right.stretched(&stretch)?)?, valid })
    }
}

impl From<StereoPair> for ReadPair {
    fn from(pair: StereoPair) -> Self {
        Self { pair, valid: None }
    }
}

/// As [`read_pair`], for images whose values have any range, in integers or floats; see [`ReadPair::stretched`]. Pixels of the left image
/// that are not valid, `[height][width]`, count as missing.
///
/// # Errors
/// Those of [`read_pair`].
pub fn read_stretched_pair(
    images: [&Path; 2],
    valid: Option<&[bool]>,
    max_megapixels: u32,
    max_memory: Option<u64>,
) -> Result<ReadPair, Error> {
    let room = Room::new(max_megapixels, max_memory).without(valid.map_or(0, |valid| valid.len() as u64));
    room.stretched_pair(images, valid, |room, path| {
        let contents = room.explained(Contents::of_pixels(path, room.limits))?;
        room.explained(parse_samples(path, &contents.bytes, room.limits))
    })
}

/// The most bytes that the program holds while it stretches a pair of this size, of one channel or three, in memory.
#[must_use]
pub fn stretching_bytes(size: Size, channels: usize) -> u64 {
    PROGRAM + stretching(channels) * size.pixels() as u64
}

/// Fails if a pair in memory cannot be stretched within the memory that is free or, by the options, allowed.
///
/// # Errors
/// [`Error::OutOfMemory`].
pub fn check_stretching(options: &Options, size: Size, channels: usize) -> Result<(), Error> {
    Room::new(Limits::MEGAPIXELS, options.max_memory).check(size, stretching(channels), "stretching")
}

/// Bytes per pixel of both images as floats, and of what is made of them.
fn stretching(channels: usize) -> u64 {
    2 * channels as u64 * Samples::VALUE_BYTES + STRETCHING
}

/// How many pixels and bytes an image may take.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Room {
    pub(crate) limits: Limits,
    /// The limit that the caller can raise, if there is one and it is lower than the free memory.
    allowed: Option<u64>,
}

impl Room {
    pub(crate) fn new(max_megapixels: u32, max_memory: Option<u64>) -> Self {
        let free = Memory::available_to(DeviceKind::Processor);
        let left = |allowed: u64| allowed.saturating_sub(PROGRAM).max(SMALL);
        let allowed = max_memory.filter(|&allowed| free.is_none_or(|free| left(allowed) <= free));
        Self { limits: Limits::megapixels(max_megapixels).within(allowed.map(left).or(free)), allowed }
    }

    /// What is left of it besides `taken` bytes.
    pub(crate) fn without(self, taken: u64) -> Self {
        Self { limits: self.limits.without(taken), ..self }
    }

    /// A pair of images, each from one call of `read`, rectified if asked for.
    pub(crate) fn pair(
        self,
        images: [&Path; 2],
        rectifying: Option<&Rectifying>,
        mut read: impl FnMut(Self, &Path) -> Result<Image, Error>,
    ) -> Result<StereoPair, Error> {
        let [left, right] = images;
        let one = read(self, left)?;
        let other = read(self.without(one.bytes()), right)?;
        let pair = StereoPair::new(one, other).map_err(|error| named(images, error))?;
        match rectifying {
            Some(rectifying) => {
                self.without(pair.bytes()).check(pair.size(), RECTIFYING, "rectifying")?;
                rectifying.rectified(&pair)
            }
            None => Ok(pair),
        }
    }

    /// A pair of images of any range of values, each from one call of `read`, in 8 bits.
    pub(crate) fn stretched_pair(
        self,
        images: [&Path; 2],
        valid: Option<&[bool]>,
        mut read: impl FnMut(Self, &Path) -> Result<Samples, Error>,
    ) -> Result<ReadPair, Error> {
        let [left, right] = images;
        let mut one = read(self, left)?;
        valid.iter().for_each(|valid| one.restrict(valid));
        let other = read(self.without(one.bytes()), right)?;
        self.without(one.bytes() + other.bytes()).check(one.size(), STRETCHING, "stretching")?;
        ReadPair::stretched(one, other).map_err(|error| named(images, error))
    }

    /// Fails if so many bytes for each pixel of a pair of this size are not left for this step.
    fn check(self, size: Size, a_pixel: u64, step: &str) -> Result<(), Error> {
        let needed = a_pixel * size.pixels() as u64;
        let Some(left) = self.limits.memory.filter(|&left| left < needed) else { return Ok(()) };
        let what = format!("{step} {size}");
        Err(self.refused(needed, left, IMAGES).of(what))
    }

    /// Fails if so many bytes for a list of pairs are not left.
    pub(crate) fn check_list(self, name: &str, needed: u64) -> Result<(), Error> {
        let Some(left) = self.limits.memory.filter(|&left| left < needed) else { return Ok(()) };
        Err(self.refused(needed, left, LIST).of(format!("the pairs of {name}")))
    }

    /// Why `needed` bytes where `left` are left are too much. `less` is how to need less.
    fn refused(self, needed: u64, left: u64, less: &str) -> Error {
        let (reason, advice) = match self.allowed {
            Some(_) => ("allowed by `max_memory`", format!("raise it, or {less}")),
            None => ("free", less.to_owned()),
        };
        let beside = self.allowed.map_or(0, |available| available.saturating_sub(left).max(PROGRAM));
        let (needed, available) = (needed.saturating_add(beside), self.allowed.unwrap_or(left));
        Error::OutOfMemory { needed, available, reason, advice }
    }

    /// The outcome of reading an image, with advice if the limit can be raised.
    pub(crate) fn explained<T>(self, read: Result<T, bp_io::Error>) -> Result<T, Error> {
        self.advised(read, IMAGES)
    }

    /// The outcome of reading a list, in the same way.
    pub(crate) fn explained_list<T>(self, read: Result<T, bp_io::Error>) -> Result<T, Error> {
        self.advised(read, LIST)
    }

    fn advised<T>(self, read: Result<T, bp_io::Error>, less: &str) -> Result<T, Error> {
        read.map_err(|error| match (error, self.allowed, self.limits.memory) {
            (bp_io::Error::OutOfMemory { path, needed, .. }, Some(_), Some(left)) => {
                self.refused(needed, left, less).of(format!("reading {}", path.display()))
            }
            (error, ..) => error.into(),
        })
    }
}

/// The failure with the names of both images.
fn named([left, right]: [&Path; 2], error: bp_core::Error) -> Error {
    Error::from(error).of(format!("{} and {}", left.display(), right.display()))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::Cause;

    #[test]
    fn images_beyond_the_allowed_memory_are_refused_with_the_least_that_would_do() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("image.pgm");
        fs::write(&path, [&b"P5 1000 2000 255\n"[..], &[7; 2_000_000]].concat()).unwrap();
        let read = |max_memory| read_pair([&path, &path], 2, max_memory);
        assert!(read(None).is_ok());
        let refused = read(Some(PROGRAM)).unwrap_err();
        let Error::Of { source, .. } = refused else { panic!("{refused}") };
        assert_eq!(source.cause(), Cause::Memory);
        let Error::OutOfMemory { needed, .. } = *source else { panic!("{source}") };
        // The second image comes on top.
        assert!(read(Some(needed)).is_err() && read(Some(needed + 2_000_000)).is_ok());
    }
}
