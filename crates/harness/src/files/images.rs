//! Reading images.

use std::{fs::File, io::BufReader, path::Path};

use bp_core::{Image, Size, image::narrow};
use image::{DynamicImage, ImageDecoder, ImageReader, Limits};
use sha2::{Digest, Sha256};

use crate::failure::Failure;

/// The most pixels that a file may hold.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PixelLimit {
    /// Pixels.
    pub(crate) pixels: u64,
}

impl PixelLimit {
    /// The default, in megapixels.
    pub(crate) const MEGAPIXELS: u32 = 100;

    /// A limit of so many megapixels.
    pub(crate) fn megapixels(megapixels: u32) -> Self {
        Self { pixels: u64::from(megapixels) * 1_000_000 }
    }

    /// Refuses a size beyond the limit.
    pub(crate) fn check(self, path: &Path, width: u64, height: u64) -> Result<(), Failure> {
        if width.saturating_mul(height) <= self.pixels {
            return Ok(());
        }
        let limit = self.pixels / 1_000_000;
        Err(Failure::input(format!(
            "{}: {width}x{height} pixels exceed the limit of {limit} megapixels; --max-megapixels raises it",
            path.display()
        )))
    }
}

/// Reads an image of 8 or 16 bits, grey or colour; transparency is ignored.
pub(crate) fn read_image(path: &Path, limit: PixelLimit) -> Result<Image, Failure> {
    let decoded = decode(path, limit)?;
    let (width, height) = (decoded.width() as usize, decoded.height() as usize);
    let sixteen = matches!(decoded.color().bytes_per_pixel() / decoded.color().channel_count(), 2);
    let pixels = if sixteen {
        decoded.into_rgb16().pixels().map(|pixel| pixel.0.map(narrow)).collect()
    } else {
        decoded.into_rgb8().pixels().map(|pixel| pixel.0).collect()
    };
    Image::from_rgb(width, height, pixels).map_err(|error| Failure::reading(path, &error))
}

/// Reads the grey values of an image with all their bits, and whether those are 16. Colours must be grey.
pub(crate) fn read_grey16(path: &Path, limit: PixelLimit) -> Result<(Size, Vec<u16>, bool), Failure> {
    let decoded = decode(path, limit)?;
    let size = Size { width: decoded.width() as usize, height: decoded.height() as usize };
    if let DynamicImage::ImageLuma16(grey) = decoded {
        return Ok((size, grey.into_raw(), true));
    }
    let grey = |pixel: &image::Rgb<u8>| (pixel.0 == [pixel.0[0]; 3]).then_some(u16::from(pixel.0[0]));
    let values: Option<Vec<u16>> = decoded.into_rgb8().pixels().map(grey).collect();
    let coloured = || Failure::reading(path, &"a map holds grey values, this image has colours");
    Ok((size, values.ok_or_else(coloured)?, false))
}

/// SHA-256 of decoded pixels, row by row, a byte for each of red, green and blue.
pub(crate) fn pixels_sha256(image: &Image) -> String {
    hex(&Sha256::digest(image.pixels().as_flattened()))
}

/// Bytes as hexadecimal digits.
pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn decode(path: &Path, limit: PixelLimit) -> Result<DynamicImage, Failure> {
    let failed = |error: &dyn std::fmt::Display| Failure::reading(path, error);
    let file = File::open(path).map_err(|e| failed(&e))?;
    if file.metadata().is_ok_and(|data| data.is_dir()) {
        return Err(failed(&"is a folder, not an image"));
    }
    let mut reader = ImageReader::new(BufReader::new(file)).with_guessed_format().map_err(|e| failed(&e))?;
    if reader.format().is_none() {
        return Err(failed(&"not an image in a known format (PNG, PGM, PPM)"));
    }
    // Room for the widest pixels at the limit: what is refused then is refused for its size.
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(limit.pixels.saturating_mul(16).saturating_add(1 << 20));
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(|e| failed(&e))?;
    let (width, height) = decoder.dimensions();
    limit.check(path, width.into(), height.into())?;
    DynamicImage::from_decoder(decoder).map_err(|e| failed(&e))
}
