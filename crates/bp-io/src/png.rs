//! PNG images without their metadata: a colour profile of some kilobytes can stand for gigabytes.

use std::{io::Cursor, path::Path};

use ::png::{BitDepth, ColorType, Decoder, DecodingError, Limits as Reserve, Reader, Transformations};
use image::{DynamicImage, ImageBuffer};

use crate::{
    Error, Limits,
    decoding::{Decoded, ENDS_EARLY, check_memory},
};

/// Most bytes of the metadata that the decoder cannot pass over: what a camera noted.
const METADATA: u64 = 4 << 20;

/// Rows that the decoder holds, at most.
const ROWS: u64 = 4;

/// Decodes a file.
pub(crate) fn decode(path: &Path, bytes: &[u8], limit: Limits) -> Result<DynamicImage, Error> {
    let undecoded = |error| undecoded(path, error);
    let mut decoder = decoder(bytes);
    let (width, height) = decoder.read_header_info().map_err(undecoded)?.size();
    limit.check_size(path, width.into(), height.into())?;
    // One row for the transformation, of at most 8 bytes a pixel, comes on top.
    decoder.set_limits(Reserve { bytes: METADATA as usize + 8 * width as usize });
    let reader = decoder.read_info().map_err(undecoded)?;
    let file = bytes.len() as u64;
    let (color, depth) = reader.output_color_type();
    let image = Decoded {
        pixels: u64::from(width) * u64::from(height),
        total: reader.output_buffer_size().map_or(u64::MAX, |bytes| bytes as u64),
        value_bytes: if depth == BitDepth::Sixteen { 2 } else { 1 },
        channels: if matches!(color, ColorType::Grayscale | ColorType::GrayscaleAlpha) { 1 } else { 3 },
    };
    let row = image.total.div_ceil(u64::from(height.max(1)));
    let meanwhile = ROWS.saturating_mul(row).saturating_add(2 * file.min(METADATA));
    check_memory(path, limit, file, &image, meanwhile)?;
    image_of(reader, [width, height], image.total).map_err(undecoded)?.ok_or_else(|| Error::reading(path, &ENDS_EARLY))
}

/// Whether the decoder stretches the values to 8 bits.
pub(crate) fn is_stretched(path: &Path, bytes: &[u8]) -> Result<bool, Error> {
    let mut decoder = decoder(bytes);
    let about = decoder.read_header_info().map_err(|error| undecoded(path, error))?;
    Ok(about.color_type == ColorType::Grayscale && !matches!(about.bit_depth, BitDepth::Eight | BitDepth::Sixteen))
}

fn decoder(bytes: &[u8]) -> Decoder<Cursor<&[u8]>> {
    let mut decoder = Decoder::new_with_limits(Cursor::new(bytes), Reserve { bytes: METADATA as usize });
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    // Palettes become colours, and values of less than 8 bits become bytes.
    decoder.set_transformations(Transformations::EXPAND);
    decoder
}

/// Decodes the pixels. `None` if they have no kind that the decoder's transformation gives.
fn image_of(
    mut reader: Reader<Cursor<&[u8]>>,
    [width, height]: [u32; 2],
    total: u64,
) -> Result<Option<DynamicImage>, DecodingError> {
    let (color, bits) = reader.output_color_type();
    if bits == BitDepth::Sixteen {
        let mut values = vec![0_u16; total as usize / 2];
        reader.next_frame(bytemuck::cast_slice_mut(&mut values))?;
        values.iter_mut().for_each(|value| *value = u16::from_be(*value));
        return Ok(match color {
            ColorType::Grayscale => ImageBuffer::from_raw(width, height, values).map(DynamicImage::ImageLuma16),
            ColorType::GrayscaleAlpha => ImageBuffer::from_raw(width, height, values).map(DynamicImage::ImageLumaA16),
            ColorType::Rgb => ImageBuffer::from_raw(width, height, values).map(DynamicImage::ImageRgb16),
            ColorType::Rgba => ImageBuffer::from_raw(width, height, values).map(DynamicImage::ImageRgba16),
            ColorType::Indexed => None,
        });
    }
    let mut values = vec![0_u8; total as usize];
    reader.next_frame(&mut values)?;
    Ok(match color {
        ColorType::Grayscale => ImageBuffer::from_raw(width, height, values).map(DynamicImage::ImageLuma8),
        ColorType::GrayscaleAlpha => ImageBuffer::from_raw(width, height, values).map(DynamicImage::ImageLumaA8),
        ColorType::Rgb => ImageBuffer::from_raw(width, height, values).map(DynamicImage::ImageRgb8),
        ColorType::Rgba => ImageBuffer::from_raw(width, height, values).map(DynamicImage::ImageRgba8),
        ColorType::Indexed => None,
    })
}

/// Why a file could not be decoded.
fn undecoded(path: &Path, error: DecodingError) -> Error {
    match error {
        DecodingError::IoError(error) => Error::reading(path, &format!("{ENDS_EARLY} ({error})")),
        DecodingError::LimitsExceeded => {
            Error::reading(path, &format!("its metadata have more than {} MiB; save it without", METADATA >> 20))
        }
        error => Error::reading(path, &format!("not a PNG that can be decoded: {error}")),
    }
}

#[cfg(test)]
mod tests {
    use ::png::{Compression, Encoder, chunk};

    use super::*;

    /// A grey image of 8x8 pixels with a chunk before the pixels.
    fn with_chunk(kind: [u8; 4], data: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, 8, 8);
        encoder.set_color(ColorType::Grayscale);
        encoder.set_compression(Compression::Fast);
        let mut writer = encoder.write_header().unwrap();
        writer.write_chunk(chunk::ChunkType(kind), data).unwrap();
        writer.write_image_data(&[100; 64]).unwrap();
        drop(writer);
        bytes
    }

    fn read(bytes: &[u8]) -> Result<DynamicImage, Error> {
        let limits = Limits { memory: Some(64 << 10), ..Limits::megapixels(1) };
        decode(Path::new("image.png"), bytes, limits)
    }

    #[test]
    fn metadata_are_passed_over() {
        for kind in [*b"iCCP", *b"zTXt", *b"tEXt", *b"iTXt"] {
            let image = read(&with_chunk(kind, &[b'x'; 20_000])).unwrap();
            assert_eq!(image.as_luma8().unwrap().as_raw(), &[100; 64]);
        }
    }

    #[test]
    fn what_a_camera_noted_is_read_up_to_a_limit() {
        assert!(read(&with_chunk(*b"eXIf", b"II*\0\x08\0\0\0\0\0")).is_ok());
        let bytes = with_chunk(*b"eXIf", &vec![0; 5 << 20]);
        let words = decode(Path::new("image.png"), &bytes, Limits::megapixels(1)).unwrap_err().to_string();
        assert!(words.contains("metadata"), "{words}");
    }
}
