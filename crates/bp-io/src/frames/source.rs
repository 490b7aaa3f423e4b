//! Frames that are read.

use std::{
    fmt,
    io::{BufRead, BufReader, Chain, Cursor, Read},
    path::{Path, PathBuf},
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
};

use bp_core::{Image, StereoPair};
use y4m::{Decoder, Ratio};

use crate::{Error, Limits};

/// The longest header of a stream, in bytes.
const MOST_HEADER: u64 = 1024;

/// The most bytes of memory for a pixel of a frame: its samples, its brightness and its images.
const PIXEL: u64 = 6 + 1 + 1;

/// Where the two images of a frame are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Layout {
    /// The left half is the left image, the right half the right one.
    #[default]
    SideBySide,
    /// The upper half is the left image, the lower half the right one.
    TopBottom,
}

impl Layout {
    /// Both layouts.
    pub const ALL: [Self; 2] = [Self::SideBySide, Self::TopBottom];

    /// The name used in options.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::SideBySide => "side-by-side",
            Self::TopBottom => "top-bottom",
        }
    }
}

/// A stream of YUV4MPEG2 frames with 8, 10 or 12 bits. Only their brightness is used.
pub struct Frames {
    path: PathBuf,
    decoder: Decoder<Counted>,
    /// Bytes read by the decoder.
    bytes: Arc<AtomicU64>,
    /// Complete frames so far.
    count: u64,
}

/// Counts the bytes that are read, which tells the end of a stream from the end within a frame.
struct Counted {
    reader: Chain<Cursor<Vec<u8>>, BufReader<Box<dyn Read + Send>>>,
    bytes: Arc<AtomicU64>,
}

impl Read for Counted {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.reader.read(buffer)?;
        self.bytes.fetch_add(count as u64, Ordering::Relaxed);
        Ok(count)
    }
}

impl Frames {
    /// Reads the header of a stream; messages call it `path`.
    ///
    /// # Errors
    /// [`Error::Read`] if it is not such a stream, or if its frames exceed the limit.
    pub fn new(reader: Box<dyn Read + Send>, path: &Path, limits: Limits) -> Result<Self, Error> {
        let mut reader = BufReader::new(reader);
        let mut header = Vec::new();
        let read = reader.by_ref().take(MOST_HEADER).read_until(b'\n', &mut header);
        read.map_err(|error| Error::reading(path, &error))?;
        check_size(path, &header, limits)?;
        let bytes = Arc::new(AtomicU64::new(0));
        let counted = Counted { reader: Cursor::new(header).chain(reader), bytes: Arc::clone(&bytes) };
        let decoder = Decoder::new(counted).map_err(|error| Error::reading(path, &described(&error)))?;
        Ok(Self { path: path.to_owned(), decoder, bytes, count: 0 })
    }

    /// Frames per second.
    fn rate(&self) -> Ratio {
        self.decoder.get_framerate()
    }

    /// The brightness of the next frame, `[height][width]`, as 8-bit values; `None` at the end of the stream.
    fn next(&mut self) -> Result<Option<Grey>, Error> {
        let (width, height) = (self.decoder.get_width(), self.decoder.get_height());
        let (depth, begin) = (self.decoder.get_bit_depth(), self.bytes.load(Ordering::Relaxed));
        let frame = match self.decoder.read_frame() {
            Ok(frame) => frame,
            Err(y4m::Error::EOF) if self.bytes.load(Ordering::Relaxed) == begin => return Ok(None),
            Err(error) => {
                let what = format!("frame {}: {}", self.count + 1, described(&error));
                return Err(Error::reading(&self.path, &what));
            }
        };
        self.count += 1;
        let plane = frame.get_y_plane();
        let values = if depth == 8 { plane.to_vec() } else { narrowed(plane, depth) };
        Ok(Some(Grey { width, height, values }))
    }
}

/// Refuses a header whose frames are too large, before anything is allocated for them.
fn check_size(path: &Path, header: &[u8], limits: Limits) -> Result<(), Error> {
    let side = |name: u8| {
        let mut fields = header.trim_ascii_end().split(|&byte| byte == b' ');
        let field = fields.rfind(|field| field.first() == Some(&name))?;
        std::str::from_utf8(&field[1..]).ok()?.parse::<u32>().ok()
    };
    let (Some(width), Some(height)) = (side(b'W'), side(b'H')) else {
        return Err(Error::reading(path, &described(&y4m::Error::ParseError(y4m::ParseError::InvalidY4M))));
    };
    // Both images have to be within the limit.
    let both = Limits { pixels: limits.pixels.saturating_mul(2), ..limits };
    both.check_size(path, width.into(), height.into())?;
    both.check_memory(path, u64::from(width) * u64::from(height) * PIXEL)
}

/// What is wrong with a stream.
fn described(error: &y4m::Error) -> String {
    match error {
        y4m::Error::EOF => "it ends within the frame".into(),
        y4m::Error::UnknownColorspace => "pixels of a kind that is not known; use yuv420p or gray, for example".into(),
        y4m::Error::IoError(error) => error.to_string(),
        _ => "not a YUV4MPEG2 stream; ffmpeg makes one with -f yuv4mpegpipe".into(),
    }
}

/// The 8-bit values of little-endian values with `depth` bits, rounded to nearest.
fn narrowed(plane: &[u8], depth: usize) -> Vec<u8> {
    let most = (1_u32 << depth) - 1;
    let value = |bytes: &[u8]| u32::from(u16::from_le_bytes([bytes[0], bytes[1]])).min(most);
    plane.chunks_exact(2).map(|bytes| ((value(bytes) * 255 + most / 2) / most) as u8).collect()
}

/// Grey values, `[height][width]`.
struct Grey {
    width: usize,
    height: usize,
    values: Vec<u8>,
}

impl Grey {
    fn image(self, path: &Path) -> Result<Image, Error> {
        Image::from_grey(self.width, self.height, self.values).map_err(|error| Error::reading(path, &error))
    }

    /// The two halves.
    fn halves(self, layout: Layout) -> Option<[Self; 2]> {
        let Self { width, height, mut values } = self;
        match layout {
            Layout::TopBottom if height.is_multiple_of(2) => {
                let lower = values.split_off(values.len() / 2);
                Some([values, lower].map(|values| Self { width, height: height / 2, values }))
            }
            Layout::SideBySide if width.is_multiple_of(2) => {
                let half = width / 2;
                let rows = |begin: usize| values.chunks_exact(width).flat_map(move |row| &row[begin..begin + half]);
                Some([0, half].map(|begin| Self { width: half, height, values: rows(begin).copied().collect() }))
            }
            _ => None,
        }
    }
}

/// The frames of a stereo video.
#[derive(Debug)]
pub enum PairFrames {
    /// Both images in one stream.
    Joined(Box<Frames>, Layout),
    /// A stream for the left image and one for the right one.
    Separate(Box<[Frames; 2]>),
}

impl PairFrames {
    /// The next pair; `None` at the end of the stream.
    ///
    /// # Errors
    /// [`Error::Read`] if the stream ends within a frame, if one of two streams ends before the other, or if images differ in size.
    pub fn next_pair(&mut self) -> Result<Option<StereoPair>, Error> {
        let images = match self {
            Self::Joined(frames, layout) => frames.next()?.map(|frame| frames.split(frame, *layout)).transpose()?,
            Self::Separate(both) => {
                let [left, right] = &mut **both;
                match (left.next()?, right.next()?) {
                    (None, None) => None,
                    (Some(one), Some(other)) => Some([one.image(&left.path)?, other.image(&right.path)?]),
                    (one, _) => {
                        let ended = if one.is_none() { left } else { right };
                        let what = format!("it ends after {} frames, before the other stream", ended.count);
                        return Err(Error::reading(&ended.path, &what));
                    }
                }
            }
        };
        let paired = images.map(|[left, right]| StereoPair::new(left, right));
        paired.transpose().map_err(|error| Error::reading(&self.first().path, &error))
    }

    /// Frames per second, as a fraction.
    #[must_use]
    pub fn rate(&self) -> [usize; 2] {
        let Ratio { num, den } = self.first().rate();
        [num, den]
    }

    fn first(&self) -> &Frames {
        match self {
            Self::Joined(frames, _) => frames,
            Self::Separate(both) => &both[0],
        }
    }
}

impl Frames {
    fn split(&self, frame: Grey, layout: Layout) -> Result<[Image; 2], Error> {
        let side = if layout == Layout::SideBySide { "wide" } else { "high" };
        let odd = || {
            Error::reading(&self.path, &format!("frames are an odd number of pixels {side}, so they have no halves"))
        };
        let [left, right] = frame.halves(layout).ok_or_else(odd)?;
        Ok([left.image(&self.path)?, right.image(&self.path)?])
    }
}

impl fmt::Debug for Frames {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.debug_struct("Frames").field("path", &self.path).field("count", &self.count).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A stream with this header and these frames.
    fn stream(header: &str, frames: &[&[u8]]) -> Result<Frames, Error> {
        let frames = frames.iter().flat_map(|frame| [b"FRAME\n", *frame]).flatten();
        let bytes: Vec<u8> = format!("YUV4MPEG2 {header}\n").bytes().chain(frames.copied()).collect();
        Frames::new(Box::new(Cursor::new(bytes)), Path::new("pipe"), Limits::default())
    }

    /// The grey values of all pairs.
    fn pairs(mut frames: PairFrames) -> Result<Vec<[Vec<u8>; 2]>, Error> {
        let grey = |image: &Image| image.greys().to_vec();
        let mut found = Vec::new();
        while let Some(pair) = frames.next_pair()? {
            found.push([grey(pair.left()), grey(pair.right())]);
        }
        Ok(found)
    }

    fn joined(header: &str, frames: &[&[u8]], layout: Layout) -> Result<Vec<[Vec<u8>; 2]>, Error> {
        pairs(PairFrames::Joined(Box::new(stream(header, frames)?), layout))
    }

    fn separate(left: &[&[u8]], right: &[&[u8]]) -> Result<Vec<[Vec<u8>; 2]>, Error> {
        pairs(PairFrames::Separate(Box::new([stream("W2 H2 Cmono", left)?, stream("W2 H2 Cmono", right)?])))
    }

    #[test]
    fn images_are_the_halves_of_frames_or_frames_of_two_streams() {
        let expected = Ok(vec![[vec![1, 2, 5, 6], vec![3, 4, 7, 8]], [vec![0; 4], vec![9; 4]]]);
        let (side, top) = (Layout::SideBySide, Layout::TopBottom);
        let beside: [&[u8]; 2] = [&[1, 2, 3, 4, 5, 6, 7, 8], &[0, 0, 9, 9, 0, 0, 9, 9]];
        assert_eq!(joined("W4 H2 F30:1 Cmono", &beside, side), expected);
        // Chroma is passed over, a quarter of the size each.
        let coloured = beside.map(|grey| [grey, &[77; 4]].concat());
        assert_eq!(joined("W4 H2 C420jpeg", &[&coloured[0], &coloured[1]], side), expected);
        assert_eq!(joined("W4 H2", &[&coloured[0], &coloured[1]], side), expected);
        assert_eq!(joined("W2 H4 Cmono", &[&[1, 2, 5, 6, 3, 4, 7, 8], &[0, 0, 0, 0, 9, 9, 9, 9]], top), expected);
        assert_eq!(separate(&[&[1, 2, 5, 6], &[0; 4]], &[&[3, 4, 7, 8], &[9; 4]]), expected);
        assert_eq!(joined("W4 H2 Cmono", &[], side), Ok(Vec::new()));
    }

    #[test]
    fn twelve_bits_become_eight_rounded() {
        let values = [0_u16, 8, 9, 4095];
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        assert_eq!(joined("W4 H1 Cmono12", &[&bytes], Layout::SideBySide), Ok(vec![[vec![0, 0], vec![1, 255]]]));
    }

    #[test]
    fn broken_streams_are_refused_with_the_frame() {
        let refused = |found: Result<Vec<[Vec<u8>; 2]>, Error>, word: &str| {
            let message = found.unwrap_err().to_string();
            assert!(message.starts_with("pipe: ") && message.contains(word), "{message}");
        };
        let side = Layout::SideBySide;
        refused(joined("W4 H2 Cmono", &[&[0; 8], &[0; 7]], side), "frame 2: it ends within");
        refused(joined("W4 H2 Cmono", &[&[0; 9]], side), "frame 2: ");
        refused(joined("W3 H2 Cmono", &[&[0; 6]], side), "odd number of pixels wide");
        refused(joined("W4 H1 Cmono", &[&[0; 4]], Layout::TopBottom), "odd number of pixels high");
        refused(joined("W4 H2 C411", &[], side), "yuv420p");
        refused(joined("W4 Cmono", &[], side), "not a YUV4MPEG2 stream");
        refused(joined("W0 H2 Cmono", &[], side), "not a YUV4MPEG2 stream");
        refused(joined("W4294967295 H4294967295 Cmono", &[], side), "max_megapixels");
        refused(joined("W4 W99999999999999999999 H2 Cmono", &[], side), "not a YUV4MPEG2 stream");
        refused(separate(&[&[0; 4], &[0; 4]], &[&[0; 4]]), "ends after 1 frames, before the other");
    }
}
