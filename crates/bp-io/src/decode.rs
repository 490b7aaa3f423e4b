//! Decodes images in memory, after their headers were compared with the limits.

use std::{fmt::Display, io::Cursor, path::Path};

use image::{
    ColorType, DynamicImage, ExtendedColorType, ImageDecoder, ImageError, ImageFormat, ImageReader,
    codecs::{pnm::PnmDecoder, tiff::TiffDecoder},
};

use crate::{
    Error, Limits,
    caught::caught,
    decoding::{Decoded, ENDS_EARLY, TILE, check_memory},
    headers::{check_pam, jpeg_metadata, tiff_lists},
    png,
};

/// Calls a decoder. Some panic on broken files: the crate `png` 0.18.1 does if a palette ends within a colour.
pub(crate) fn decoded<T>(path: &Path, decode: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
    let broken = |words| Err(Error::reading(path, &format!("{ENDS_EARLY} (the decoder: {words})")));
    caught(decode).unwrap_or_else(broken)
}

/// Decodes a file in one of [`FORMATS`].
pub(crate) fn decode(path: &Path, bytes: &[u8], limit: Limits) -> Result<DynamicImage, Error> {
    let failed = |error: &dyn Display| Error::reading(path, error);
    match image::guess_format(bytes).ok().filter(|format| FORMATS.contains(format)) {
        Some(ImageFormat::Png) => png::decode(path, bytes, limit),
        Some(ImageFormat::Jpeg) if !has_jpeg_end(bytes) => Err(failed(&ENDS_EARLY)),
        Some(format) => decode_as(format, path, bytes, limit),
        None => Err(failed(&UNKNOWN)),
    }
}

fn decode_as(format: ImageFormat, path: &Path, bytes: &[u8], limit: Limits) -> Result<DynamicImage, Error> {
    let (undecoded, file) = (|error| undecoded(path, format, error), bytes.len() as u64);
    // What the decoder holds before it tells the size: lists of strips; or a copy of the file, and of its metadata two.
    let before = match format {
        ImageFormat::Tiff => tiff_lists(path, bytes)?,
        ImageFormat::Jpeg => file + 2 * jpeg_metadata(path, bytes)?,
        _ => check_pam(path, bytes).map(|()| 0)?,
    };
    limit.check_memory(path, file + before)?;
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    reader.limits(image::Limits::no_limits());
    let mut decoder = reader.into_decoder().map_err(undecoded)?;
    let (width, height) = decoder.dimensions();
    limit.check_size(path, width.into(), height.into())?;
    if matches!(decoder.color_type(), ColorType::Rgb32F | ColorType::Rgba32F) {
        return Err(Error::reading(path, &OTHER_TIFF));
    }
    let (pixels, total) = (u64::from(width) * u64::from(height), decoder.total_bytes());
    // What the decoder holds beside the image: a strip or tile, and the image in four colours; or coefficients of whole blocks.
    let blocks = u64::from(width.next_multiple_of(16)) * u64::from(height.next_multiple_of(16));
    let meanwhile = before
        + match format {
            ImageFormat::Tiff => 2 * total + TILE,
            ImageFormat::Jpeg => 8 * blocks,
            _ => 0,
        };
    let color = decoder.color_type();
    let value_bytes = u64::from(color.bytes_per_pixel() / color.channel_count());
    let channels = if color.has_color() { 3 } else { 1 };
    check_memory(path, limit, file, &Decoded { pixels, total, value_bytes, channels }, meanwhile)?;
    let mut decoding = image::Limits::no_limits();
    decoding.max_alloc = Some(2 * total + TILE);
    decoder.set_limits(decoding).map_err(undecoded)?;
    DynamicImage::from_decoder(decoder).map_err(undecoded)
}

/// Refuses files whose stored values cannot be recovered: JPEG is lossy, and decoders stretch values of other bit
/// depths to 8 or 16 bits.
pub(crate) fn check_unscaled(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let failed = |error: &dyn Display| Error::reading(path, error);
    let is_stretched = match image::guess_format(bytes) {
        Ok(ImageFormat::Pnm) => {
            let decoder = PnmDecoder::new(Cursor::new(bytes)).map_err(|e| failed(&e))?;
            !matches!(decoder.header().maximal_sample(), 255 | 65535)
        }
        Ok(ImageFormat::Png) => png::is_stretched(path, bytes)?,
        Ok(ImageFormat::Tiff) => {
            tiff_lists(path, bytes)?;
            let decoder = TiffDecoder::new(Cursor::new(bytes)).map_err(|e| failed(&e))?;
            decoder.original_color_type() == ExtendedColorType::L1
        }
        Ok(ImageFormat::Jpeg) => return Err(failed(&"a JPEG keeps about what was stored, and a map needs all of it")),
        _ => false,
    };
    if is_stretched {
        Err(failed(&"a map needs 8 or 16 bits a value, used in full (maximum 255 or 65535)"))
    } else {
        Ok(())
    }
}

/// Why a file is no image.
pub(crate) const UNKNOWN: &str =
    "not an image in a known format (PNG, PGM, PPM, TIFF, JPEG, PFM; maps and, with `stretch`, images also NPY)";

/// The formats of images, besides PFM.
const FORMATS: [ImageFormat; 4] = [ImageFormat::Png, ImageFormat::Pnm, ImageFormat::Tiff, ImageFormat::Jpeg];

const OTHER_TIFF: &str = "a TIFF image holds 8 or 16 bits, grey or RGB; with `stretch`, also grey floats";

/// Why a file could not be decoded.
fn undecoded(path: &Path, format: ImageFormat, error: ImageError) -> Error {
    match error {
        ImageError::Limits(_) => Error::reading(path, &"its strips or tiles are larger than the image; save it anew"),
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
