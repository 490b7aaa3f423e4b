//! Reading images.

use std::{
    fs::File,
    io::{Cursor, ErrorKind, Read},
    path::Path,
};

use bp_core::{Image, Size, image::narrow};
use image::{
    ColorType, DynamicImage, ExtendedColorType, ImageDecoder, ImageError, ImageFormat, ImageReader,
    codecs::{png::PngDecoder, pnm::PnmDecoder, tiff::TiffDecoder},
};
use sha2::{Digest, Sha256};

use crate::{Error, Limits, caught::caught, pfm};

/// Reads an image with 8 or 16 bits, or a PFM, grey or colour. Ignores transparency and the orientation tag of cameras.
///
/// # Errors
/// [`Error::Read`] and [`Error::OutOfMemory`].
pub fn read_image(path: &Path, limit: Limits) -> Result<Image, Error> {
    parse_image(path, &read_limited(path, limit)?, limit)
}

/// Parses an image in memory; messages call it `path`.
///
/// # Errors
/// Those of [`read_image`].
pub fn parse_image(path: &Path, bytes: &[u8], limit: Limits) -> Result<Image, Error> {
    let (size, pixels) = if pfm::is_pfm(bytes) {
        let file = pfm::parse(path, bytes, limit)?;
        (file.size, file.into_pixels(path)?)
    } else {
        let decoded = decoded(path, || decode(path, bytes, limit))?;
        (size(path, &decoded)?, colours(decoded))
    };
    Image::from_rgb(size.width, size.height, pixels).map_err(|error| Error::reading(path, &error))
}

/// The colours, as 8-bit values.
fn colours(image: DynamicImage) -> Vec<[u8; 3]> {
    if has_16_bits(&image) {
        image.into_rgb16().pixels().map(|pixel| pixel.0.map(narrow)).collect()
    } else {
        image.into_rgb8().pixels().map(|pixel| pixel.0).collect()
    }
}

/// The size. Fails if it is 0, which some formats allow.
fn size(path: &Path, image: &DynamicImage) -> Result<Size, Error> {
    let size = Size::new(image.width() as usize, image.height() as usize);
    size.map_err(|error| Error::reading(path, &error))
}

fn has_16_bits(image: &DynamicImage) -> bool {
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

/// Reads the grey values of an image as they are stored.
///
/// # Errors
/// [`Error::Read`] if it is not an image or has colours, [`Error::OutOfMemory`].
pub fn read_stored_grey(path: &Path, limit: Limits) -> Result<StoredGrey, Error> {
    stored_grey(path, &read_limited(path, limit)?, limit)
}

/// Parses the grey values of a file in memory.
pub(crate) fn stored_grey(path: &Path, bytes: &[u8], limit: Limits) -> Result<StoredGrey, Error> {
    let decoded = decoded(path, || {
        check_unscaled(path, bytes)?;
        decode(path, bytes, limit)
    })?;
    let size = size(path, &decoded)?;
    let sixteen = has_16_bits(&decoded);
    let grey = |[r, g, b]: [u16; 3]| (r == g && g == b).then_some(r);
    let values: Option<Vec<u16>> = if sixteen {
        decoded.into_rgb16().pixels().map(|pixel| grey(pixel.0)).collect()
    } else {
        decoded.into_rgb8().pixels().map(|pixel| grey(pixel.0.map(u16::from))).collect()
    };
    let coloured = || Error::reading(path, &"a map holds grey values, this image has colours");
    Ok(StoredGrey { size, values: values.ok_or_else(coloured)?, has_16_bits: sixteen })
}

/// Refuses files whose stored values cannot be recovered: JPEG is lossy, and decoders stretch values of other bit
/// depths to 8 or 16 bits.
fn check_unscaled(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let failed = |error: &dyn std::fmt::Display| Error::reading(path, error);
    let stretched = match image::guess_format(bytes) {
        Ok(ImageFormat::Pnm) => {
            let decoder = PnmDecoder::new(Cursor::new(bytes)).map_err(|e| failed(&e))?;
            !matches!(decoder.header().maximal_sample(), 255 | 65535)
        }
        Ok(ImageFormat::Png) => {
            let decoder = PngDecoder::new(Cursor::new(bytes)).map_err(|e| failed(&e))?;
            let narrow = [ExtendedColorType::L1, ExtendedColorType::L2, ExtendedColorType::L4];
            narrow.contains(&decoder.original_color_type())
        }
        Ok(ImageFormat::Tiff) => {
            let decoder = TiffDecoder::new(Cursor::new(bytes)).map_err(|e| failed(&e))?;
            decoder.original_color_type() == ExtendedColorType::L1
        }
        Ok(ImageFormat::Jpeg) => return Err(failed(&"a JPEG keeps about what was stored, and a map needs all of it")),
        _ => false,
    };
    if stretched {
        Err(failed(&"a map needs 8 or 16 bits a value, used in full (maximum 255 or 65535)"))
    } else {
        Ok(())
    }
}

/// SHA-256 of the decoded pixels, row by row, with one byte each for red, green and blue.
#[must_use]
pub fn pixels_sha256(image: &Image) -> String {
    hex(&Sha256::digest(image.pixels().as_flattened()))
}

/// Bytes as hexadecimal digits.
#[must_use]
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Reads a file or a pipe, up to the most bytes that an image within the limit can have.
pub(crate) fn read_limited(path: &Path, limit: Limits) -> Result<Vec<u8>, Error> {
    let failed = |error: &dyn std::fmt::Display| Error::reading(path, error);
    let file = File::open(path).map_err(|e| failed(&e))?;
    if file.metadata().is_ok_and(|data| data.is_dir()) {
        return Err(failed(&"is a folder, not an image"));
    }
    let most = limit.file_bytes();
    let mut bytes = Vec::new();
    file.take(most.saturating_add(1)).read_to_end(&mut bytes).map_err(|error| match error.kind() {
        ErrorKind::OutOfMemory => Error::OutOfMemory { path: path.to_owned(), needed: most, available: None },
        _ => failed(&error),
    })?;
    if bytes.len() as u64 > most {
        return Err(failed(&"the file is too long for the pixels it may hold; raise `max_megapixels`"));
    }
    Ok(bytes)
}

/// Decodes a file. Some decoders panic on broken files: the crate `png` 0.18.1 does if a palette ends within a colour.
pub(crate) fn decoded<T>(path: &Path, decode: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
    let broken = |words| Err(Error::reading(path, &format!("{ENDS_EARLY} (the decoder: {words})")));
    caught(decode).unwrap_or_else(broken)
}

fn decode(path: &Path, bytes: &[u8], limit: Limits) -> Result<DynamicImage, Error> {
    let failed = |error: &dyn std::fmt::Display| Error::reading(path, error);
    let format = image::guess_format(bytes).ok().filter(|format| FORMATS.contains(format));
    let format = format.ok_or_else(|| failed(&"not an image in a known format (PNG, PGM, PPM, TIFF, JPEG, PFM)"))?;
    if format == ImageFormat::Jpeg && !has_jpeg_end(bytes) {
        return Err(failed(&ENDS_EARLY));
    }
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut decoding = image::Limits::no_limits();
    decoding.max_alloc = Some(limit.file_bytes());
    reader.limits(decoding);
    let decoder = reader.into_decoder().map_err(|error| undecoded(path, format, error))?;
    let (width, height) = decoder.dimensions();
    limit.check_size(path, width.into(), height.into())?;
    if matches!(decoder.color_type(), ColorType::Rgb32F | ColorType::Rgba32F) {
        return Err(failed(&OTHER_TIFF));
    }
    let pixels = u64::from(width) * u64::from(height);
    // The decoded image, two copies as 8-bit colours during its conversion, and what its decoder holds meanwhile.
    let meanwhile = match format {
        ImageFormat::Tiff => decoder.total_bytes(),
        ImageFormat::Jpeg => 8 * pixels,
        _ => 0,
    };
    let needed = decoder.total_bytes().saturating_add(6 * pixels + meanwhile);
    limit.check_memory(path, needed)?;
    DynamicImage::from_decoder(decoder).map_err(|error| undecoded(path, format, error))
}

/// The formats of images, besides PFM.
const FORMATS: [ImageFormat; 4] = [ImageFormat::Png, ImageFormat::Pnm, ImageFormat::Tiff, ImageFormat::Jpeg];

const ENDS_EARLY: &str = "the file ends too early or is broken";

const OTHER_TIFF: &str = "a TIFF image holds 8 or 16 bits, grey or RGB; save others so, or floats as PFM";

/// Why a file could not be decoded.
fn undecoded(path: &Path, format: ImageFormat, error: ImageError) -> Error {
    match error {
        ImageError::Limits(_) => Error::reading(path, &"too large an image; raise `max_megapixels`"),
        ImageError::IoError(error) => Error::reading(path, &format!("{ENDS_EARLY} ({error})")),
        ImageError::Unsupported(_) if format == ImageFormat::Tiff => Error::reading(path, &OTHER_TIFF),
        error => Error::reading(path, &error),
    }
}

/// Whether the end marker comes after the last start of scan. The decoder would invent the pixels that a cut file
/// lacks.
fn has_jpeg_end(bytes: &[u8]) -> bool {
    let last = |marker: [u8; 2]| bytes.windows(2).rposition(|pair| pair == marker);
    last([0xff, 0xd9]) > last([0xff, 0xda])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_decoder_panics_on_is_refused() {
        let bytes = include_bytes!("../../../fuzz/corpus/image/cut_palette.png");
        let read = || parse_image(Path::new("palette.png"), bytes, Limits::megapixels(1));
        let message = read().unwrap_err().to_string();
        assert!(message.contains("palette.png") && message.contains(ENDS_EARLY), "{message}");
    }
}
