//! Reading images.

use std::path::Path;

use bp_core::{Image, Size, image::narrow};
use image::{DynamicImage, ExtendedColorType, ImageEncoder as _, codecs::png::PngEncoder};
use sha2::{Digest, Sha256};

use crate::{
    Contents, Error, Files, Limits,
    caught::caught,
    decode::{check_unscaled, decode, decoded},
    pfm,
};

/// Reads an image with 8 or 16 bits, or a PFM, grey or colour. Ignores transparency and the orientation tag of cameras.
///
/// # Errors
/// [`Error::Read`] and [`Error::OutOfMemory`].
pub fn read_image(path: &Path, limit: Limits) -> Result<Image, Error> {
    parse_image(path, &Contents::of_pixels(path, limit)?.bytes, limit)
}

/// Writes an image as a PNG of 8 bits, in grey if it has no colours.
///
/// # Errors
/// [`Error::Write`].
pub fn write_image(files: &Files, path: &Path, image: &Image) -> Result<(), Error> {
    let Size { width, height } = image.size();
    let (bytes, kind) = match image.colours() {
        Some(colours) => (colours.as_flattened(), ExtendedColorType::Rgb8),
        None => (image.greys(), ExtendedColorType::L8),
    };
    files.whole(path, |file| PngEncoder::new(file).write_image(bytes, width as u32, height as u32, kind))
}

/// Parses an image in memory; messages call it `path`.
///
/// # Errors
/// Those of [`read_image`].
pub fn parse_image(path: &Path, bytes: &[u8], limit: Limits) -> Result<Image, Error> {
    if pfm::is_pfm(bytes) {
        return pfm::parse(path, bytes, limit)?.into_image(path);
    }
    let decoded = decoded(path, || decode(path, bytes, limit))?;
    converted(path, decoded, in_8_bits)?.map_err(|error| Error::reading(path, &error))
}

/// Converts pixels. The crate `image` 0.25.10 panics if there is no memory for them.
pub(crate) fn converted<T>(
    path: &Path,
    image: DynamicImage,
    convert: impl FnOnce(DynamicImage) -> T,
) -> Result<T, Error> {
    let needed = 3 * u64::from(image.width()) * u64::from(image.height());
    caught(|| convert(image)).map_err(|_| Error::OutOfMemory { path: path.to_owned(), needed, available: None })
}

fn in_8_bits(image: DynamicImage) -> Result<Image, bp_core::Error> {
    let (width, height) = (image.width() as usize, image.height() as usize);
    // What was decoded is freed before the image is made.
    if image.color().has_color() {
        let colours = colours(image);
        Image::from_rgb(width, height, colours)
    } else {
        let greys = greys(image);
        Image::from_grey(width, height, greys)
    }
}

fn colours(image: DynamicImage) -> Vec<[u8; 3]> {
    if has_16_bits(&image) {
        image.into_rgb16().pixels().map(|pixel| pixel.0.map(narrow)).collect()
    } else {
        image.into_rgb8().pixels().map(|pixel| pixel.0).collect()
    }
}

fn greys(image: DynamicImage) -> Vec<u8> {
    if has_16_bits(&image) {
        image.into_luma16().iter().map(|&grey| narrow(grey)).collect()
    } else {
        image.into_luma8().into_raw()
    }
}

/// The size. Fails if it is 0, which some formats allow.
pub(crate) fn size(path: &Path, image: &DynamicImage) -> Result<Size, Error> {
    let size = Size::new(image.width() as usize, image.height() as usize);
    size.map_err(|error| Error::reading(path, &error))
}

pub(crate) fn has_16_bits(image: &DynamicImage) -> bool {
    image.color().bytes_per_pixel() == 2 * image.color().channel_count()
}

/// Grey values as a file stores them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StoredGrey {
    /// Width and height.
    pub size: Size,
    /// `[height][width]`.
    pub values: Vec<u16>,
    /// Whether the file has 16 bits per value, not 8.
    pub has_16_bits: bool,
}

/// Parses the grey values of an image in memory as they are stored; messages call it `path`.
///
/// # Errors
/// [`Error::Read`] if it is not an image or has colours, [`Error::OutOfMemory`].
pub fn parse_stored_grey(path: &Path, bytes: &[u8], limit: Limits) -> Result<StoredGrey, Error> {
    let decoded = decoded(path, || {
        check_unscaled(path, bytes)?;
        decode(path, bytes, limit)
    })?;
    let (size, has_16_bits) = (size(path, &decoded)?, has_16_bits(&decoded));
    limit.check_memory(path, bytes.len() as u64 + grey_bytes(&decoded))?;
    let values = converted(path, decoded, grey_values)?;
    let coloured = || Error::reading(path, &"a map holds grey values, this image has colours");
    Ok(StoredGrey { size, values: values.ok_or_else(coloured)?, has_16_bits })
}

/// Bytes for each pixel of what is made of grey values, beside the values: a map of floats.
const OF_GREY: u64 = 4;

/// The most bytes that an image, its grey values and what is made of them take, one after another: the transparency is dropped,
/// then each value becomes 16 bits.
fn grey_bytes(image: &DynamicImage) -> u64 {
    let (pixels, color) = (u64::from(image.width()) * u64::from(image.height()), image.color());
    let (total, channels) = (u64::from(color.bytes_per_pixel()), u64::from(color.channel_count()));
    let kept = if color.has_alpha() { total / channels * (channels - 1) } else { 0 };
    pixels * (total + kept).max(total + 2).max(2 + OF_GREY)
}

/// The grey values of an image; `None` if it has colours.
fn grey_values(image: DynamicImage) -> Option<Vec<u16>> {
    let grey = |[r, g, b]: [u16; 3]| (r == g && g == b).then_some(r);
    match (image.color().has_color(), has_16_bits(&image)) {
        (false, true) => Some(image.into_luma16().into_raw()),
        (false, false) => Some(image.into_luma8().iter().map(|&value| value.into()).collect()),
        (true, true) => image.into_rgb16().pixels().map(|pixel| grey(pixel.0)).collect(),
        (true, false) => image.into_rgb8().pixels().map(|pixel| grey(pixel.0.map(u16::from))).collect(),
    }
}

/// SHA-256 of the decoded pixels, row by row, with one byte each for red, green and blue.
#[must_use]
pub fn pixels_sha256(image: &Image) -> String {
    let mut hash = Sha256::new();
    for y in 0..image.size().height as isize {
        match image.colours_near(y) {
            Some(colours) => hash.update(colours.as_flattened()),
            None => hash.update(image.greys_near(y).iter().flat_map(|&grey| [grey; 3]).collect::<Vec<_>>()),
        }
    }
    hex(&hash.finalize())
}

/// Bytes as hexadecimal digits.
#[must_use]
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decoding::ENDS_EARLY;

    #[test]
    fn what_a_decoder_panics_on_is_refused() {
        let bytes = include_bytes!("../../../fuzz/corpus/image/cut_palette.png");
        let read = || parse_image(Path::new("palette.png"), bytes, Limits::megapixels(1));
        let message = read().unwrap_err().to_string();
        assert!(message.contains("palette.png") && message.contains(ENDS_EARLY), "{message}");
    }
}
