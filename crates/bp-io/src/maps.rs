//! Reading disparity maps and masks.

use std::path::Path;

use bp_core::{DisparityMap, Size};
use image::ImageFormat;

use crate::{
    Contents, Error, Limits, Quantity,
    decode::decoded,
    images::{StoredGrey, parse_stored_grey},
    npy, pfm,
    sidecar::{Told, sidecar_of, told},
    tiff,
};

/// Reads a disparity map. Stored integers are divided by `scale`, by default 256 for 16 bits and 1 for 8 bits; 0 means
/// unknown. Floats are divided by `scale` if it is given; values that are not finite are unknown.
///
/// Refuses the map if its sidecar says that it holds another quantity. If the sidecar says that values are negated, so are those
/// that are read.
///
/// # Errors
/// [`Error::Read`] and [`Error::OutOfMemory`].
pub fn read_map(path: &Path, scale: Option<f32>, limit: Limits) -> Result<DisparityMap, Error> {
    let told = told(path)?;
    if let Some(Told { quantity, .. }) = told.as_ref().filter(|told| told.quantity != Quantity::Disparity.name()) {
        let sidecar = sidecar_of(path);
        let what = format!("it holds {quantity}, as {} tells, and disparities are needed", sidecar.display());
        return Err(Error::reading(path, &what));
    }
    let bytes = Contents::of_pixels(path, limit)?.bytes;
    let Some(range) = told.and_then(|told| told.negated) else { return parse_map(path, &bytes, scale, limit) };
    let map = parse_signed(path, &bytes, scale, -1.0, limit)?;
    // Another program may have written the map anew, and not the sidecar.
    let scale = scale.unwrap_or(1.0);
    if map.range() != range.map(|[min, max]| (min / scale, max / scale)) {
        let sidecar = sidecar_of(path);
        let what = format!("{} describes another map; remove it if it is out of date", sidecar.display());
        return Err(Error::reading(path, &what));
    }
    Ok(map)
}

/// Parses a map in memory; messages call it `path`.
///
/// # Errors
/// Those of [`read_map`].
pub fn parse_map(path: &Path, bytes: &[u8], scale: Option<f32>, limit: Limits) -> Result<DisparityMap, Error> {
    parse_signed(path, bytes, scale, 1.0, limit)
}

/// [`parse_map`], with all values multiplied by `sign`.
fn parse_signed(
    path: &Path,
    bytes: &[u8],
    scale: Option<f32>,
    sign: f32,
    limit: Limits,
) -> Result<DisparityMap, Error> {
    let (size, values) = match floats(path, bytes, limit)? {
        Some((size, values)) => (size, values.into_iter().map(|value| value / (sign * scale.unwrap_or(1.0))).collect()),
        None => {
            let StoredGrey { size, values, has_16_bits } = parse_stored_grey(path, bytes, limit)?;
            let scale = sign * scale.unwrap_or(if has_16_bits { 256.0 } else { 1.0 });
            let disparity = |value: u16| if value == 0 { DisparityMap::UNKNOWN } else { f32::from(value) / scale };
            (size, values.into_iter().map(disparity).collect())
        }
    };
    DisparityMap::new(size, values).map_err(|error| Error::reading(path, &error))
}

/// The values of a file, if it holds floats.
pub(crate) fn floats(path: &Path, bytes: &[u8], limit: Limits) -> Result<Option<(Size, Vec<f32>)>, Error> {
    if pfm::is_pfm(bytes) {
        return pfm::parse(path, bytes, limit)?.into_map(path).map(Some);
    }
    if npy::is_npy(bytes) {
        return npy::parse(path, bytes, limit).map(Some);
    }
    match image::guess_format(bytes) {
        Ok(ImageFormat::Tiff) => decoded(path, || tiff::parse(path, bytes, limit)),
        _ => Ok(None),
    }
}

/// A selection of pixels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mask {
    /// Width and height.
    pub size: Size,
    /// `[height][width]`.
    pub values: Vec<bool>,
}

/// Reads an 8-bit mask. Pixels with the value 255 are selected; there must be one.
///
/// # Errors
/// [`Error::Read`] and [`Error::OutOfMemory`].
pub fn read_mask(path: &Path, limit: Limits) -> Result<Mask, Error> {
    parse_mask(path, &Contents::of_pixels(path, limit)?.bytes, limit)
}

/// Parses a mask in memory; messages call it `path`.
///
/// # Errors
/// Those of [`read_mask`].
pub fn parse_mask(path: &Path, bytes: &[u8], limit: Limits) -> Result<Mask, Error> {
    let StoredGrey { size, values, has_16_bits } = parse_stored_grey(path, bytes, limit)?;
    if has_16_bits {
        return Err(Error::reading(path, &"a mask has 8 bits, 255 where a pixel counts"));
    }
    if !values.contains(&255) {
        return Err(Error::reading(path, &"no pixel is 255, so the mask selects none"));
    }
    Ok(Mask { size, values: values.into_iter().map(|value| value == 255).collect() })
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::{Files, Raster};

    fn map(values: &[f32]) -> DisparityMap {
        DisparityMap::new(Size { width: 2, height: values.len() / 2 }, values.to_vec()).unwrap()
    }

    #[test]
    fn maps_survive_every_format() {
        let folder = tempfile::tempdir().unwrap();
        let original = map(&[0.0, 1.5, DisparityMap::UNKNOWN, 255.5, 7.25, 64.0]);
        for name in ["map.pfm", "map.png", "map.tif", "map.npy"] {
            let path = folder.path().join(name);
            Raster::disparities(&original).write(&Files::default(), &path).unwrap();
            let read = read_map(&path, None, Limits::megapixels(1)).unwrap();
            let differs = |(a, b): (&f32, &f32)| a != b && !(name == "map.png" && *a == 0.0 && *b == 1.0 / 256.0);
            assert!(!original.values().iter().zip(read.values()).any(differs), "{name}: {read:?}");
        }
        for beyond in [-1.0, 256.0] {
            assert!(
                Raster::disparities(&map(&[beyond, 0.0]))
                    .write(&Files::default(), &folder.path().join("no.png"))
                    .is_err()
            );
        }
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 4);
    }

    #[test]
    fn maps_and_masks_without_pixels_are_refused() {
        let (path, empty) = (Path::new("map.pgm"), b"P5 0 5 255\n");
        assert!(parse_map(path, empty, None, Limits::megapixels(1)).is_err());
        assert!(parse_mask(path, empty, Limits::megapixels(1)).is_err());
    }
}
