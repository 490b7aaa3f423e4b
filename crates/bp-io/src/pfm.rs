//! Portable float maps, as images and as maps: 32-bit floats, rows from bottom to top.

use std::{io::Write, path::Path};

use bp_core::{
    DisparityMap, Image, Size,
    image::{factor_to_8_bits, scaled},
};

use crate::{Error, Limits};

/// The contents of a file.
pub(crate) struct Pfm {
    /// Width and height.
    pub(crate) size: Size,
    /// 1 for grey, 3 for colours.
    pub(crate) channels: usize,
    /// `[height][width][channel]`.
    pub(crate) values: Vec<f32>,
}

/// Whether the bytes begin like a PFM file.
pub(crate) fn is_pfm(bytes: &[u8]) -> bool {
    bytes.starts_with(b"Pf") || bytes.starts_with(b"PF")
}

/// Writes grey values in little-endian byte order.
pub(crate) fn write(file: &mut dyn Write, size: Size, values: &[f32]) -> std::io::Result<()> {
    let Size { width, height } = size;
    write!(file, "Pf\n{width} {height}\n-1.0\n")?;
    for row in values.chunks_exact(width).rev() {
        for value in row {
            file.write_all(&value.to_le_bytes())?;
        }
    }
    Ok(())
}

/// Reads grey values or colours in either byte order.
pub(crate) fn parse(path: &Path, bytes: &[u8], limit: Limits) -> Result<Pfm, Error> {
    let failed = |what: &str| Error::reading(path, &what);
    let (header, data) = split_header(bytes).ok_or_else(|| failed("not a PFM file: its header is broken"))?;
    let [kind, width, height, order] = header;
    let channels = match kind {
        "Pf" => 1,
        "PF" => 3,
        _ => return Err(failed("not a PFM file: it should begin with \"Pf\" or \"PF\"")),
    };
    let side = |text: &str| text.parse::<usize>().map_err(|_| failed("the PFM header holds no size"));
    let size = Size::new(side(width)?, side(height)?).map_err(|error| Error::reading(path, &error))?;
    limit.check_size(path, size.width as u64, size.height as u64)?;
    let order = order.parse().ok().filter(|order: &f32| *order != 0.0 && order.is_finite());
    let order = order.ok_or_else(|| failed("the PFM header holds no byte order (a number below or above 0)"))?;
    let needed = 4 * channels * size.pixels();
    if data.len() != needed {
        return Err(failed(&format!("{} bytes of values where {size} pixels need {needed}", data.len())));
    }
    let value = |bytes: &[u8]| {
        let bytes = [bytes[0], bytes[1], bytes[2], bytes[3]];
        if order < 0.0 { f32::from_le_bytes(bytes) } else { f32::from_be_bytes(bytes) }
    };
    // The file, its values and, of an image, those in 8 bits.
    limit.check_memory(path, (bytes.len() + needed + channels * size.pixels()) as u64)?;
    let rows = data.chunks_exact(4 * channels * size.width).rev();
    let mut values = Vec::with_capacity(channels * size.pixels());
    values.extend(rows.flat_map(|row| row.chunks_exact(4).map(value)));
    Ok(Pfm { size, channels, values })
}

/// The four words of a PFM header, and the data after the single white space that ends it.
fn split_header(bytes: &[u8]) -> Option<([&str; 4], &[u8])> {
    let mut words = [""; 4];
    let mut rest = bytes;
    for word in &mut words {
        let start = rest.iter().position(|byte| !byte.is_ascii_whitespace())?;
        let len = rest[start..].iter().take(32).position(|byte| byte.is_ascii_whitespace())?;
        *word = std::str::from_utf8(&rest[start..start + len]).ok()?;
        rest = &rest[start + len..];
    }
    Some((words, &rest[1..]))
}

impl Pfm {
    /// The map of a grey file.
    pub(crate) fn into_map(self, path: &Path) -> Result<(Size, Vec<f32>), Error> {
        match self.channels {
            1 => Ok((self.size, self.values)),
            _ => Err(Error::reading(path, &"a map holds grey values (\"Pf\"), this PFM file has colours (\"PF\")")),
        }
    }

    /// An image, from values from 0 to 1 or from 0 to 255. If no value is above 1, all are multiplied by 255.
    pub(crate) fn into_image(self, path: &Path) -> Result<Image, Error> {
        let factor = factor_to_8_bits(self.values.iter().copied()).map_err(|wrong| {
            let is_map = if wrong.0 == DisparityMap::UNKNOWN { "; is it a disparity map?" } else { "" };
            Error::reading(path, &format!("{wrong}{is_map}"))
        })?;
        let Size { width, height } = self.size;
        let values = self.values.into_iter().map(|value| scaled(value, factor)).collect::<Vec<_>>();
        let image = match self.channels {
            1 => Image::from_grey(width, height, values),
            _ => Image::from_rgb(width, height, values.as_chunks().0.to_vec()),
        };
        image.map_err(|error| Error::reading(path, &error))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: Size = Size { width: 2, height: 2 };

    fn read(bytes: &[u8]) -> Result<Pfm, Error> {
        parse(Path::new("map.pfm"), bytes, Limits::megapixels(1))
    }

    #[test]
    fn files_are_little_endian_from_bottom_to_top() {
        let mut bytes = Vec::new();
        write(&mut bytes, SIZE, &[1.0, 2.0, f32::INFINITY, 4.5]).unwrap();
        let mut expected = b"Pf\n2 2\n-1.0\n".to_vec();
        expected.extend([0, 0, 0x80, 0x7f, 0, 0, 0x90, 0x40, 0, 0, 0x80, 0x3f, 0, 0, 0, 0x40]);
        assert_eq!(bytes, expected);
    }

    #[test]
    fn both_byte_orders_are_read() {
        let little = b"Pf\n1 2\n-1.0\n\x00\x00\x80\x3f\x00\x00\x00\x40";
        let big = b"Pf\n1 2\n1.0\n\x3f\x80\x00\x00\x40\x00\x00\x00";
        for bytes in [&little[..], big] {
            assert_eq!(read(bytes).unwrap().values, [2.0, 1.0]);
        }
    }

    #[test]
    fn broken_files_are_refused() {
        let cases: [&[u8]; 10] = [
            b"",
            b"Pf",
            b"PF\n1 1\n-1\nabcd",
            b"Pf\n0 1\n-1\n",
            b"Pf\n1 1\n-1\nabc",
            b"Pf\n-1 1\n-1\nabcd",
            b"Pf\n99999999 99999999\n-1\n",
            b"Pf\n1 1\n0\nabcd",
            b"Pf\n1 1\nnan\nabcd",
            b"Pf 1 1 x abcd",
        ];
        for bytes in cases {
            assert!(read(bytes).is_err(), "{bytes:?}");
        }
    }

    #[test]
    fn image_values_are_shares_of_white_or_8_bit_values() {
        let pixels = |values: [f32; 3], channels| {
            let size = Size { width: 3 / channels, height: 1 };
            let image = Pfm { size, channels, values: values.to_vec() }.into_image(Path::new("image.pfm"))?;
            Ok::<_, Error>(image.pixels().to_vec())
        };
        assert_eq!(pixels([0.0, 0.5, 1.0], 1).unwrap(), [[0; 3], [128; 3], [255; 3]]);
        assert_eq!(pixels([0.0, 127.6, 255.0], 3).unwrap(), [[0, 128, 255]]);
        for odd in [-1.0, 255.5, f32::NAN, f32::INFINITY] {
            assert!(pixels([0.0, 0.0, odd], 1).is_err(), "{odd}");
        }
    }
}
