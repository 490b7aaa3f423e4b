//! Disparity maps on disk.
//!
//! `.pfm` holds the disparities themselves: 32-bit floats, rows from bottom to top, plus infinity where unknown. `.png`
//! holds 256 times the disparity in 16 bits, 0 where unknown; a disparity of 0 is stored as 1, the least that is known.

use std::{io::Write, path::Path};

use bp_core::{DisparityMap, Size};
use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};

use super::{PixelLimit, images::read_limited, read_stored_grey, write_whole};
use crate::failure::Failure;

/// How a map is stored, by the file's ending.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum MapFormat {
    /// Portable float map.
    Pfm,
    /// PNG of 16 bits, disparity x256.
    Png16,
}

impl MapFormat {
    /// The format of an output path.
    fn of(path: &Path) -> Result<Self, Failure> {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        match ending.as_deref() {
            Some("pfm") => Ok(Self::Pfm),
            Some("png") => Ok(Self::Png16),
            _ => Err(Failure::usage(format!("{}: a map ends in .pfm or .png", path.display()))),
        }
    }
}

/// Fails where a path's ending names no format, or one that cannot hold disparities from `low` to `high`; for telling so
/// before the work is done.
pub(crate) fn check_range(path: &Path, low: i32, high: i32) -> Result<(), Failure> {
    match MapFormat::of(path)? {
        MapFormat::Png16 if low < 0 || high > 255 => Err(out_of_png_range(path)),
        _ => Ok(()),
    }
}

/// Fails where a path does not end in .png.
pub(crate) fn check_png(path: &Path) -> Result<(), Failure> {
    match MapFormat::of(path) {
        Ok(MapFormat::Png16) => Ok(()),
        _ => Err(Failure::usage(format!("{}: a picture ends in .png", path.display()))),
    }
}

fn out_of_png_range(path: &Path) -> Failure {
    let what = "a 16-bit PNG holds disparities from 0 to 255.99 px; use an output that ends in .pfm";
    Failure::usage(format!("{}: {what}", path.display()))
}

/// Writes a map in the format of the path's ending.
pub(crate) fn write_map(path: &Path, map: &DisparityMap) -> Result<(), Failure> {
    match MapFormat::of(path)? {
        MapFormat::Pfm => write_whole(path, |file| write_pfm(file, map)),
        MapFormat::Png16 => {
            let values = png_values(map).ok_or_else(|| out_of_png_range(path))?;
            let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_ne_bytes()).collect();
            let Size { width, height } = map.size();
            write_whole(path, |file| {
                PngEncoder::new(file).write_image(&bytes, width as u32, height as u32, ExtendedColorType::L16)
            })
        }
    }
}

/// 256 times the disparity, at least 1; 0 where unknown. `None` where one does not fit.
fn png_values(map: &DisparityMap) -> Option<Vec<u16>> {
    let value = |&disparity: &f32| match (disparity * 256.0).round() {
        _ if !disparity.is_finite() => Some(0),
        scaled if (0.0..=65535.0).contains(&scaled) => Some((scaled as u16).max(1)),
        _ => None,
    };
    map.values().iter().map(value).collect()
}

fn write_pfm(file: &mut dyn Write, map: &DisparityMap) -> std::io::Result<()> {
    let Size { width, height } = map.size();
    write!(file, "Pf\n{width} {height}\n-1.0\n")?;
    for row in map.values().chunks_exact(width).rev() {
        for value in row {
            file.write_all(&value.to_le_bytes())?;
        }
    }
    Ok(())
}

/// Reads a map. Stored values of images are divided by `scale`, by default 256 where they have 16 bits and 1 where they
/// have 8; 0 is unknown. A PFM's values are divided by `scale` where that is given.
pub(crate) fn read_map(path: &Path, scale: Option<f32>, limit: PixelLimit) -> Result<DisparityMap, Failure> {
    let is_pfm = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("pfm"));
    let (size, values) = if is_pfm {
        let scale = scale.unwrap_or(1.0);
        let (size, values) = read_pfm(path, limit)?;
        (size, values.into_iter().map(|value| value / scale).collect())
    } else {
        let (size, values, sixteen) = read_stored_grey(path, limit)?;
        let scale = scale.unwrap_or(if sixteen { 256.0 } else { 1.0 });
        let disparity = |value: u16| if value == 0 { DisparityMap::UNKNOWN } else { f32::from(value) / scale };
        (size, values.into_iter().map(disparity).collect())
    };
    DisparityMap::new(size, values).map_err(|error| Failure::reading(path, &error))
}

/// Reads a mask `[height][width]`: true where the stored value is 255.
pub(crate) fn read_mask(path: &Path, limit: PixelLimit) -> Result<(Size, Vec<bool>), Failure> {
    let (size, values, sixteen) = read_stored_grey(path, limit)?;
    if sixteen {
        return Err(Failure::reading(path, &"a mask has 8 bits, 255 where a pixel counts"));
    }
    Ok((size, values.into_iter().map(|value| value == 255).collect()))
}

fn read_pfm(path: &Path, limit: PixelLimit) -> Result<(Size, Vec<f32>), Failure> {
    let failed = |what: &str| Failure::reading(path, &what);
    let bytes = read_limited(path, limit)?;
    let (header, data) = split_header(&bytes).ok_or_else(|| failed("not a PFM file: its header is broken"))?;
    let [kind, width, height, order] = header;
    if kind != "Pf" {
        return Err(failed("not a grey PFM file: it should begin with \"Pf\""));
    }
    let side = |text: &str| text.parse::<usize>().map_err(|_| failed("the PFM header holds no size"));
    let size = Size::new(side(width)?, side(height)?).map_err(|error| Failure::reading(path, &error))?;
    limit.check(path, size.width as u64, size.height as u64)?;
    let order = order.parse().ok().filter(|order: &f32| *order != 0.0 && order.is_finite());
    let order = order.ok_or_else(|| failed("the PFM header holds no byte order (a number below or above 0)"))?;
    if data.len() != 4 * size.pixels() {
        return Err(failed(&format!("{} bytes of values where {size} pixels need {}", data.len(), 4 * size.pixels())));
    }
    let value = |bytes: &[u8]| {
        let bytes = [bytes[0], bytes[1], bytes[2], bytes[3]];
        if order < 0.0 { f32::from_le_bytes(bytes) } else { f32::from_be_bytes(bytes) }
    };
    let rows = data.chunks_exact(4 * size.width).rev();
    Ok((size, rows.flat_map(|row| row.chunks_exact(4).map(value)).collect()))
}

/// The four words of a PFM header, and what follows the one white space after them.
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

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn map(values: &[f32]) -> DisparityMap {
        DisparityMap::new(Size { width: 2, height: values.len() / 2 }, values.to_vec()).unwrap()
    }

    #[test]
    fn pfm_is_little_endian_from_bottom_to_top() {
        let mut bytes = Vec::new();
        write_pfm(&mut bytes, &map(&[1.0, 2.0, f32::INFINITY, 4.5])).unwrap();
        let mut expected = b"Pf\n2 2\n-1.0\n".to_vec();
        expected.extend([0, 0, 0x80, 0x7f, 0, 0, 0x90, 0x40, 0, 0, 0x80, 0x3f, 0, 0, 0, 0x40]);
        assert_eq!(bytes, expected);
    }

    #[test]
    fn maps_survive_both_formats() {
        let folder = tempfile::tempdir().unwrap();
        let original = map(&[0.0, 1.5, DisparityMap::UNKNOWN, 255.5, 7.25, 64.0]);
        for name in ["map.pfm", "map.png"] {
            let path = folder.path().join(name);
            write_map(&path, &original).unwrap();
            let read = read_map(&path, None, PixelLimit::megapixels(1)).unwrap();
            let differs = |(a, b): (&f32, &f32)| a != b && !(*a == 0.0 && *b == 1.0 / 256.0);
            assert!(!original.values().iter().zip(read.values()).any(differs), "{name}: {read:?}");
        }
        for beyond in [-1.0, 256.0] {
            assert!(write_map(&folder.path().join("no.png"), &map(&[beyond, 0.0])).is_err());
        }
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    }

    #[test]
    fn broken_pfm_files_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.pfm");
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
            fs::write(&path, bytes).unwrap();
            assert!(read_map(&path, None, PixelLimit::megapixels(1)).is_err(), "{bytes:?}");
        }
        fs::write(&path, b"Pf\n1 1\n1.0\n\x3f\x80\x00\x00").unwrap();
        assert_eq!(read_map(&path, None, PixelLimit::megapixels(1)).unwrap().at(0, 0), Some(1.0));
    }
}
