//! What the headers of TIFF, JPEG and PAM files say about the memory for decoding them. Their decoders look at that too late, or
//! not at all.

use std::path::Path;

use crate::{Error, decoding::TILE};

/// Most bytes in memory of the lists in a TIFF's header: where its strips are, how long they are.
const LISTS: u64 = 64 << 20;

/// Bytes in memory of a value in such a list, which the decoder keeps in two forms.
const LISTED: u64 = 48;

/// Most bytes of a JPEG that are not its pixels, such as colour profiles.
const METADATA: u64 = 16 << 20;

/// Most bytes of a PAM's header.
const HEADER: usize = 4096;

/// Tags of a TIFF's header.
const WIDTH: u64 = 256;
const HEIGHT: u64 = 257;
const BITS: u64 = 258;
const COMPRESSION: u64 = 259;
const SAMPLES: u64 = 277;
const TILE_WIDTH: u64 = 322;
const TILE_HEIGHT: u64 = 323;

/// The compressions of strips that are JPEG files of their own, of any size.
const JPEGS: [u64; 3] = [6, 7, 34892];

/// The bytes in memory of a TIFF's lists. Refuses lists, tiles and compressions for which the image's size says nothing about the
/// memory.
pub(crate) fn tiff_lists(path: &Path, bytes: &[u8]) -> Result<u64, Error> {
    let refused = |what: &str| Err(Error::reading(path, &format!("{what}; save it anew")));
    let Some(fields) = Fields::of(bytes) else { return refused("the TIFF's header is broken") };
    let lists = fields.0.iter().fold(0, |sum: u64, field| sum.saturating_add(field.count.saturating_mul(LISTED)));
    // A value takes at least a byte of the file.
    if lists > LISTS || fields.0.iter().any(|field| field.count > bytes.len() as u64) {
        return refused("the TIFF's header has too long lists");
    }
    if fields.first(COMPRESSION).is_some_and(|compression| JPEGS.contains(&compression)) {
        return refused("a TIFF with JPEG strips is not read");
    }
    let of = |tag, other| fields.first(tag).unwrap_or(other);
    let pixel = of(SAMPLES, 1).saturating_mul(of(BITS, 1)).div_ceil(8);
    let bytes_of = |width: u64, height: u64| width.saturating_mul(height).saturating_mul(pixel);
    let image = bytes_of(of(WIDTH, 0), of(HEIGHT, 0));
    if bytes_of(of(TILE_WIDTH, 0), of(TILE_HEIGHT, 1)) > image.saturating_add(TILE) {
        return refused("the TIFF's tiles are larger than the image");
    }
    Ok(lists)
}

/// The fields of a TIFF's first image.
struct Fields(Vec<Field>);

struct Field {
    tag: u64,
    count: u64,
    /// The first value, if it is a whole number.
    first: Option<u64>,
}

impl Fields {
    fn of(bytes: &[u8]) -> Option<Self> {
        let number = |at: usize, len: usize| {
            let part = bytes.get(at..at.checked_add(len)?)?;
            let push = |value: u64, &byte: &u8| value << 8 | u64::from(byte);
            Some(if bytes[0] == b'I' { part.iter().rev().fold(0, push) } else { part.iter().fold(0, push) })
        };
        // Offsets have 4 bytes, in a BigTIFF 8.
        let (wide, start) = match number(2, 2)? {
            42 => (4, number(4, 4)?),
            43 => (8, number(8, 8)?),
            _ => return None,
        };
        let start = usize::try_from(start).ok()?;
        let (counted, field) = if wide == 4 { (2, 12) } else { (8, 20) };
        let fields = usize::try_from(number(start, counted)?).ok().filter(|&fields| fields <= bytes.len() / field)?;
        let read = |index: usize| {
            let at = start.checked_add(counted + index * field)?;
            let (kind, count) = (number(at + 2, 2)?, number(at + 4, wide)?);
            let size = match kind {
                1 => 1,
                3 => 2,
                4 => 4,
                16 => 8,
                _ => 0,
            };
            let inside = at + 4 + wide;
            let is_inside = count.saturating_mul(size as u64) <= wide as u64;
            let place = if is_inside { Some(inside) } else { usize::try_from(number(inside, wide)?).ok() };
            let first = place.filter(|_| size > 0).and_then(|place| number(place, size));
            Some(Field { tag: number(at, 2)?, count, first })
        };
        (0..fields).map(read).collect::<Option<Vec<_>>>().map(Self)
    }

    /// The first value of a field.
    fn first(&self, tag: u64) -> Option<u64> {
        self.0.iter().find(|field| field.tag == tag)?.first
    }
}

/// The bytes of a JPEG before its pixels that are not needed for them. Refuses too many.
pub(crate) fn jpeg_metadata(path: &Path, bytes: &[u8]) -> Result<u64, Error> {
    let (mut at, mut metadata) = (2, 0);
    while let Some(&[0xff, kind, high, low]) = bytes.get(at..).and_then(<[u8]>::first_chunk) {
        let len = usize::from(u16::from_be_bytes([high, low]));
        at += match kind {
            // The pixels begin.
            0xda => break,
            // A byte that fills, and markers without contents.
            0xff => 1,
            0x01 | 0xd0..=0xd8 => 2,
            _ => 2 + len,
        };
        if matches!(kind, 0xe0..=0xef | 0xfe) {
            metadata += len as u64;
        }
    }
    if metadata > METADATA {
        return Err(Error::reading(
            path,
            &format!("its metadata have more than {} MiB; save it without", METADATA >> 20),
        ));
    }
    Ok(metadata)
}

/// Refuses a PAM whose header does not end soon.
pub(crate) fn check_pam(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let header = &bytes[..bytes.len().min(HEADER)];
    if bytes.starts_with(b"P7") && !header.windows(6).any(|word| word == b"ENDHDR") {
        return Err(Error::reading(path, &format!("its header does not end within {HEADER} bytes")));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A little-endian TIFF header with these fields: tag, type, count, value.
    fn tiff(fields: &[[u32; 4]]) -> Vec<u8> {
        let mut bytes = b"II\x2a\0\x08\0\0\0".to_vec();
        bytes.extend((fields.len() as u16).to_le_bytes());
        for &[tag, kind, count, value] in fields {
            bytes.extend([tag as u16, kind as u16].map(u16::to_le_bytes).concat());
            bytes.extend([count, value].map(u32::to_le_bytes).concat());
        }
        bytes
    }

    fn lists(fields: &[[u32; 4]]) -> Result<u64, String> {
        let size = [[256, 3, 1, 8], [257, 3, 1, 8], [258, 3, 1, 8], [277, 3, 1, 1]];
        tiff_lists(Path::new("image.tif"), &tiff(&[&size[..], fields].concat())).map_err(|error| error.to_string())
    }

    #[test]
    fn headers_that_stand_for_much_memory_are_refused() {
        assert_eq!(lists(&[[273, 4, 60, 8]]), Ok(64 * LISTED));
        // The file has 70 bytes, so it has no list of 71 values.
        assert!(lists(&[[273, 1, 71, 8]]).unwrap_err().contains("lists"));
        assert!(lists(&[[273, 1, 1 << 30, 8]]).unwrap_err().contains("lists"));
        assert!(lists(&[[259, 3, 1, 7]]).unwrap_err().contains("JPEG"));
        assert!(lists(&[[322, 4, 1, 1 << 30], [323, 4, 1, 16]]).unwrap_err().contains("tiles"));
        assert!(lists(&[[322, 3, 1, 256], [323, 3, 1, 256]]).is_ok());
        let whole = tiff(&[[256, 3, 1, 8]]);
        // Without its value, a field tells nothing.
        let cut = |len: usize| tiff_lists(Path::new("cut.tif"), &whole[..len]);
        assert!((0..whole.len() - 4).all(|len| cut(len).is_err()) && cut(whole.len() - 4) == Ok(LISTED));
    }

    #[test]
    fn metadata_of_a_jpeg_are_counted_up_to_its_pixels() {
        let segment =
            |kind: u8, len: u16| [&[0xff, kind][..], &len.to_be_bytes(), &vec![0; usize::from(len) - 2]].concat();
        let count = |segments: &[Vec<u8>]| {
            jpeg_metadata(Path::new("image.jpg"), &[&[0xff, 0xd8][..], &segments.concat()].concat())
        };
        let pixels = segment(0xda, 12);
        assert_eq!(
            count(&[segment(0xe2, 1000), segment(0xdb, 67), segment(0xfe, 10), pixels, segment(0xe1, 500)]),
            Ok(1010)
        );
        assert!(count(&vec![segment(0xe2, 65_535); 300]).is_err());
    }

    #[test]
    fn a_header_of_words_without_end_is_refused() {
        let pam = |words: usize| [&b"P7\nWIDTH 1\n"[..], &vec![b'x'; words], b"\nENDHDR\n"].concat();
        assert!(check_pam(Path::new("image.pam"), &pam(10)).is_ok());
        assert!(check_pam(Path::new("image.pam"), &pam(5000)).is_err());
    }
}
