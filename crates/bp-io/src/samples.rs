//! Reading images whose values have any range.

use std::path::Path;

use bp_core::image::Samples;
use image::{DynamicImage, ImageFormat};

use crate::{
    Error, Limits,
    decode::{decode, decoded},
    images::{converted, has_16_bits, size},
    maps::floats,
    pfm, tiff,
};

/// Parses an image whose values have any range, grey or colour: as [`parse_image`](crate::parse_image), and TIFF and NPY of floats in grey. Values that a
/// TIFF declares as missing are NaN.
///
/// # Errors
/// Those of [`read_image`](crate::read_image).
pub fn parse_samples(path: &Path, bytes: &[u8], limit: Limits) -> Result<Samples, Error> {
    let (size, values) = if pfm::is_pfm(bytes) {
        let pfm = pfm::parse(path, bytes, limit)?;
        (pfm.size, pfm.values)
    } else if let Some(floats) = floats(path, bytes, limit)? {
        floats
    } else {
        let decoded = decoded(path, || decode(path, bytes, limit))?;
        let channels = if decoded.color().has_color() { 3 } else { 1 };
        let values = u64::from(decoded.width()) * u64::from(decoded.height()) * channels * 4;
        // The file, what was decoded, and the values.
        limit.check_memory(path, bytes.len() as u64 + decoded.as_bytes().len() as u64 + values)?;
        let (size, mut values) = (size(path, &decoded)?, converted(path, decoded, in_floats)?);
        if image::guess_format(bytes).is_ok_and(|format| format == ImageFormat::Tiff) {
            tiff::drop_missing(path, bytes, &mut values)?;
        }
        (size, values)
    };
    Samples::new(size, values).map_err(|error| Error::reading(path, &error))
}

/// The values as they are stored, of one channel or three.
fn in_floats(image: DynamicImage) -> Vec<f32> {
    match (image.color().has_color(), has_16_bits(&image)) {
        (true, true) => image.into_rgb16().iter().copied().map(f32::from).collect(),
        (true, false) => image.into_rgb8().iter().copied().map(f32::from).collect(),
        (false, true) => image.into_luma16().iter().copied().map(f32::from).collect(),
        (false, false) => image.into_luma8().iter().copied().map(f32::from).collect(),
    }
}
