//! NumPy's array files. Writes version 1.0 and reads 1.0 to 3.0.

use std::{io::Write, path::Path};

use bp_core::Size;

use crate::{Error, Limits};

const MAGIC: &[u8] = b"\x93NUMPY";

/// Whether the bytes begin like an NPY file.
pub(crate) fn is_npy(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

/// Writes values `[height][width]` as little-endian 32-bit floats.
pub(crate) fn write(file: &mut dyn Write, size: Size, values: &[f32]) -> std::io::Result<()> {
    let Size { width, height } = size;
    let text = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({height}, {width}), }}");
    // The header ends with a line break, at a multiple of 64 bytes.
    let len = (MAGIC.len() + 4 + text.len() + 1).next_multiple_of(64) - MAGIC.len() - 4;
    file.write_all(MAGIC)?;
    file.write_all(&[1, 0])?;
    file.write_all(&(len as u16).to_le_bytes())?;
    writeln!(file, "{text:<width$}", width = len - 1)?;
    for value in values {
        file.write_all(&value.to_le_bytes())?;
    }
    Ok(())
}

/// Reads 32- or 64-bit floats `[height][width]` in either byte order.
pub(crate) fn parse(path: &Path, bytes: &[u8], limit: Limits) -> Result<(Size, Vec<f32>), Error> {
    let failed = |what: &str| Error::reading(path, &what);
    let (header, data) = split_header(bytes).ok_or_else(|| failed("not an NPY file: its header is broken"))?;
    let value = match item(header, "descr").map(|kind| kind.trim_matches(['\'', '"'])) {
        Some("<f4") => Value { bytes: 4, little: true },
        Some(">f4") => Value { bytes: 4, little: false },
        Some("<f8") => Value { bytes: 8, little: true },
        Some(">f8") => Value { bytes: 8, little: false },
        kind => {
            let kind = kind.unwrap_or("nothing known");
            return Err(failed(&format!("a map holds floats ('<f4' or '<f8'), this array {kind}; use astype('<f4')")));
        }
    };
    if item(header, "fortran_order") != Some("False") {
        return Err(failed("the array is stored column by column; use numpy.ascontiguousarray"));
    }
    let size = shape(header).ok_or_else(|| failed("a map is an array [height][width], this is none"))?;
    let size = Size::new(size.width, size.height).map_err(|error| Error::reading(path, &error))?;
    limit.check_size(path, size.width as u64, size.height as u64)?;
    let needed = value.bytes * size.pixels();
    if data.len() != needed {
        return Err(failed(&format!("{} bytes of values where {size} pixels need {needed}", data.len())));
    }
    limit.check_memory(path, (bytes.len() + 4 * size.pixels()) as u64)?;
    Ok((size, data.chunks_exact(value.bytes).map(|bytes| value.read(bytes)).collect()))
}

/// How a number is stored.
#[derive(Clone, Copy)]
struct Value {
    bytes: usize,
    little: bool,
}

impl Value {
    fn read(self, bytes: &[u8]) -> f32 {
        let mut ordered = [0; 8];
        ordered[..bytes.len()].copy_from_slice(bytes);
        if !self.little {
            ordered[..bytes.len()].reverse();
        }
        let [a, b, c, d, ..] = ordered;
        if self.bytes == 4 { f32::from_le_bytes([a, b, c, d]) } else { f64::from_le_bytes(ordered) as f32 }
    }
}

/// Splits a file into the dictionary of its header and the data.
fn split_header(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let (version, rest) = bytes.strip_prefix(MAGIC)?.split_at_checked(2)?;
    let (len, rest) = rest.split_at_checked(if version[0] == 1 { 2 } else { 4 })?;
    let len = len.iter().rev().fold(0, |len, &byte| len << 8 | usize::from(byte));
    let (header, data) = rest.split_at_checked(len)?;
    Some((std::str::from_utf8(header).ok()?, data))
}

/// The value of an item of the dictionary. The value must not contain a comma.
fn item<'a>(header: &'a str, name: &str) -> Option<&'a str> {
    let (_, rest) = header.split_once(&format!("'{name}':"))?;
    rest.split([',', '}']).next().map(str::trim)
}

fn shape(header: &str) -> Option<Size> {
    let (_, rest) = header.split_once("'shape':")?;
    let (inside, _) = rest.trim_start().strip_prefix('(')?.split_once(')')?;
    let (height, width) = inside.trim_end_matches([' ', ',']).split_once(',')?;
    Some(Size { width: width.trim().parse().ok()?, height: height.trim().parse().ok()? })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(header: &str, data: &[u8]) -> Result<Vec<f32>, Error> {
        let bytes = [MAGIC, &[1, 0, header.len() as u8, 0], header.as_bytes(), data].concat();
        parse(Path::new("map.npy"), &bytes, Limits::megapixels(1)).map(|(_, values)| values)
    }

    #[test]
    fn the_header_is_numpys_own() {
        let mut bytes = Vec::new();
        write(&mut bytes, Size { width: 2, height: 1 }, &[1.0, f32::INFINITY]).unwrap();
        let mut expected =
            b"\x93NUMPY\x01\x00v\x00{'descr': '<f4', 'fortran_order': False, 'shape': (1, 2), }".to_vec();
        expected.resize(127, b' ');
        expected.extend(b"\n\x00\x00\x80\x3f\x00\x00\x80\x7f");
        assert_eq!(bytes, expected);
    }

    #[test]
    fn floats_of_both_sizes_and_orders_are_read() {
        let header = |kind| format!("{{'shape': (1, 2), 'fortran_order': False, 'descr': '{kind}'}}");
        assert_eq!(read(&header("<f4"), &[0, 0, 0x80, 0x3f, 0, 0, 0, 0x40]).unwrap(), [1.0, 2.0]);
        assert_eq!(read(&header(">f4"), &[0x3f, 0x80, 0, 0, 0x40, 0, 0, 0]).unwrap(), [1.0, 2.0]);
        assert_eq!(read(&header("<f8"), &[1.0_f64, -0.5].map(f64::to_le_bytes).concat()).unwrap(), [1.0, -0.5]);
        assert_eq!(read(&header(">f8"), &[1.0_f64, -0.5].map(f64::to_be_bytes).concat()).unwrap(), [1.0, -0.5]);
    }

    #[test]
    fn broken_files_and_other_arrays_are_refused() {
        for header in [
            "",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (2,), }",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 1, 2), }",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (99999999, 99999999), }",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 3), }",
            "{'descr': '<f4', 'fortran_order': True, 'shape': (1, 2), }",
            "{'descr': '<i4', 'fortran_order': False, 'shape': (1, 2), }",
        ] {
            assert!(read(header, &[0; 8]).is_err(), "{header}");
        }
        for bytes in [&b"\x93NUMPY"[..], b"\x93NUMPY\x01\x00\xff\xff{}", b"\x93NUMPY\x02\x00\xff\xff\xff\xff{}"] {
            assert!(parse(Path::new("map.npy"), bytes, Limits::megapixels(1)).is_err(), "{bytes:?}");
        }
    }
}
