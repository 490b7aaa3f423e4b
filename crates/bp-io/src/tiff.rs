//! TIFF files of floats, which the `image` crate neither reads as such nor writes.

use std::{
    io::{Cursor, ErrorKind},
    path::Path,
};

use bp_core::Size;
use tiff::{
    ColorType, TiffError, TiffResult,
    decoder::{Decoder, DecodingResult},
    encoder::{TiffEncoder, colortype::Gray32Float},
    tags::Tag,
};

use crate::{Error, Limits, headers::tiff_lists};

/// The tag with the text of the value that means none, by GDAL.
const NO_DATA: Tag = Tag::Unknown(42113);

/// The largest difference from the missing value, as a share of it. Programs write the least float as -3.40282e+38.
const NEAR: f64 = 2e-6;

/// Encodes values `[height][width]` as 32-bit floats.
pub(crate) fn encode(size: Size, values: &[f32]) -> TiffResult<Vec<u8>> {
    let mut file = Cursor::new(Vec::new());
    TiffEncoder::new(&mut file)?.write_image::<Gray32Float>(size.width as u32, size.height as u32, values)?;
    Ok(file.into_inner())
}

/// The floats `[height][width]` of a grey file, NaN for those that it declares as missing; `None` if it holds something else.
pub(crate) fn parse(path: &Path, bytes: &[u8], limit: Limits) -> Result<Option<(Size, Vec<f32>)>, Error> {
    let failed = |error: TiffError| match error {
        TiffError::IoError(error) if error.kind() == ErrorKind::UnexpectedEof => {
            Error::reading(path, &"the file ends too early or is broken")
        }
        error => Error::reading(path, &error),
    };
    let lists = tiff_lists(path, bytes)?;
    let mut decoder = Decoder::new(Cursor::new(bytes)).map_err(failed)?;
    let ColorType::Gray(bits @ (32 | 64)) = decoder.colortype().map_err(failed)? else { return Ok(None) };
    let (width, height) = decoder.dimensions().map_err(failed)?;
    limit.check_size(path, width.into(), height.into())?;
    let size = Size::new(width as usize, height as usize).map_err(|error| Error::reading(path, &error))?;
    // The values, and as many bytes of a strip or of the floats that doubles are converted to.
    let needed = 2 * u64::from(bits / 8) * size.pixels() as u64;
    limit.check_memory(path, needed.saturating_add(lists + bytes.len() as u64))?;
    let missing = missing(&mut decoder);
    let mut limits = tiff::decoder::Limits::default();
    limits.decoding_buffer_size = usize::try_from(needed).unwrap_or(usize::MAX);
    limits.intermediate_buffer_size = limits.decoding_buffer_size;
    let mut values = match decoder.with_limits(limits).read_image().map_err(failed)? {
        DecodingResult::F32(values) => values,
        DecodingResult::F64(values) => values.into_iter().map(|value| value as f32).collect(),
        _ => return Err(Error::reading(path, &"a TIFF map holds 8 or 16 bits, or floats of 32 or 64")),
    };
    if values.len() != size.pixels() {
        return Err(Error::reading(path, &format!("{} values where {size} pixels were expected", values.len())));
    }
    drop_values(missing, &mut values);
    Ok(Some((size, values)))
}

/// Makes the values NaN that a file declares as missing.
pub(crate) fn drop_missing(path: &Path, bytes: &[u8], values: &mut [f32]) -> Result<(), Error> {
    tiff_lists(path, bytes)?;
    let mut decoder = Decoder::new(Cursor::new(bytes)).map_err(|error| Error::reading(path, &error))?;
    drop_values(missing(&mut decoder), values);
    Ok(())
}

/// The value that a file declares as missing.
fn missing(decoder: &mut Decoder<Cursor<&[u8]>>) -> Option<f64> {
    let text = decoder.get_tag_ascii_string(NO_DATA).ok()?;
    text.trim_matches(|letter: char| letter == '\0' || letter.is_whitespace()).parse().ok()
}

/// Makes values NaN that are the missing one, or as near to it as text with six digits tells.
fn drop_values(missing: Option<f64>, values: &mut [f32]) {
    let Some(missing) = missing else { return };
    let is_missing = |value: f32| (f64::from(value) - missing).abs() <= NEAR * missing.abs();
    values.iter_mut().filter(|value| is_missing(**value)).for_each(|value| *value = f32::NAN);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_read_as_written_and_cut_files_refused() {
        let (size, values) = (Size { width: 3, height: 2 }, [1.0, -2.5, f32::INFINITY, 0.0, 1e-3, 255.0]);
        let bytes = encode(size, &values).unwrap();
        let read = |bytes: &[u8]| parse(Path::new("map.tif"), bytes, Limits::megapixels(1));
        assert_eq!(read(&bytes).unwrap(), Some((size, values.to_vec())));
        assert!((0..bytes.len()).all(|len| read(&bytes[..len]).is_err()));
    }
}
