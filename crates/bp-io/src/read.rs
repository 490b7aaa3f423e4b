//! Reads whole files, up to a limit.

use std::{
    fs::{File, Metadata},
    io::{ErrorKind, Read},
    path::Path,
};

use crate::{Error, Limits, decode::UNKNOWN};

/// Most bytes of a file that describes one thing: a sidecar, a calibration, an alignment, the record of a pair.
pub const MOST_DESCRIPTION: u64 = 1 << 20;

/// Most bytes of a list of pairs, and of other texts of any length.
pub const MOST_TEXT: u64 = 64 << 20;

/// A file in memory.
#[derive(Debug)]
pub struct Contents {
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// What the system said about the file before it was read, so that a change since then can be noticed.
    pub metadata: Metadata,
}

impl Contents {
    /// Reads a file of any kind, a pipe too, with at most `most` bytes.
    ///
    /// # Errors
    /// [`Error::Read`], also if there are more bytes; [`Error::OutOfMemory`].
    pub fn of(path: &Path, most: u64) -> Result<Self, Error> {
        Self::within(path, most, None)
    }

    /// [`Contents::of`] in at most `memory` bytes, if memory is limited.
    ///
    /// # Errors
    /// Those of [`Contents::of`].
    pub fn within(path: &Path, most: u64, memory: Option<u64>) -> Result<Self, Error> {
        let (file, metadata) = open(path)?;
        let bytes = text_within(file, path, metadata.len(), most, memory)?;
        Ok(Self { bytes, metadata })
    }

    /// [`Contents::of`] a regular file. Opening a pipe could wait for ever, and a device may have no end.
    ///
    /// # Errors
    /// Those of [`Contents::of`], and [`Error::Read`] for anything that is not a regular file.
    pub fn of_regular(path: &Path, most: u64) -> Result<Self, Error> {
        let about = path.metadata().map_err(|error| Error::reading(path, &error))?;
        if about.is_file() { Self::of(path, most) } else { Err(Error::reading(path, &"it is not a regular file")) }
    }

    /// Reads an image or a map, up to the most bytes that one within the limits can have.
    ///
    /// # Errors
    /// Those of [`Contents::of`].
    pub fn of_pixels(path: &Path, limit: Limits) -> Result<Self, Error> {
        let (file, metadata) = open(path)?;
        let (most, room) = (limit.file_bytes(), limit.memory.unwrap_or(u64::MAX));
        let too_long =
            || Error::reading(path, &"the file is too long for the pixels it may hold; raise `max_megapixels`");
        let no_room = |needed| Error::OutOfMemory { path: path.to_owned(), needed, available: limit.memory };
        match metadata.len() {
            bytes if bytes > most => return Err(too_long()),
            bytes if bytes > room => return Err(no_room(bytes)),
            _ => {}
        }
        // So a device without end is refused at once.
        let mut first = Vec::new();
        (&file).take(FIRST).read_to_end(&mut first).map_err(|error| Error::reading(path, &error))?;
        if !is_known(&first) {
            return Err(Error::reading(path, &UNKNOWN));
        }
        let bytes = filled(first.chain(file), path, metadata.len(), most.min(room))?;
        let bytes = bytes.ok_or_else(|| if room < most { no_room(most) } else { too_long() })?;
        Ok(Self { bytes, metadata })
    }
}

/// How many bytes tell a format.
const FIRST: u64 = 8;

/// Whether images or maps may begin with these bytes.
fn is_known(first: &[u8]) -> bool {
    let is_portable = matches!(first, [b'P', b'1'..=b'7' | b'f' | b'F', ..]);
    let begins: [&[u8]; 6] = [b"\x89PNG", b"\xff\xd8", b"II*\0", b"MM\0*", b"II+\0", b"\x93NUMPY"];
    is_portable || begins.iter().any(|begin| first.starts_with(begin))
}

fn open(path: &Path) -> Result<(File, Metadata), Error> {
    let failed = |error: std::io::Error| Error::reading(path, &error);
    let file = File::open(path).map_err(failed)?;
    let metadata = file.metadata().map_err(failed)?;
    if metadata.is_dir() { Err(Error::reading(path, &"is a folder, not a file")) } else { Ok((file, metadata)) }
}

/// Reads all of a source that has no path, such as standard input, as [`Contents::within`] does. Messages call it `name`.
///
/// # Errors
/// Those of [`Contents::of`].
pub fn read_source(source: impl Read, name: &str, most: u64, memory: Option<u64>) -> Result<Vec<u8>, Error> {
    text_within(source, Path::new(name), 0, most, memory)
}

/// The bytes of a text whose length is expected to be `len`.
fn text_within(source: impl Read, path: &Path, len: u64, most: u64, memory: Option<u64>) -> Result<Vec<u8>, Error> {
    let too_long = || Error::reading(path, &format!("it has more than {} MiB, and is not read", most >> 20));
    let no_room = |needed| Error::OutOfMemory { path: path.to_owned(), needed, available: memory };
    let room = memory.unwrap_or(u64::MAX);
    match len {
        len if len > most => return Err(too_long()),
        len if len > room => return Err(no_room(len)),
        _ => {}
    }
    let bytes = filled(source, path, len, most.min(room))?;
    bytes.ok_or_else(|| if room < most { no_room(most) } else { too_long() })
}

/// The bytes of a file; `None` if there are more than `most`, as in a device without end.
fn filled(file: impl Read, path: &Path, len: u64, most: u64) -> Result<Option<Vec<u8>>, Error> {
    let no_room = || Error::OutOfMemory { path: path.to_owned(), needed: len.max(1), available: None };
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(usize::try_from(len).unwrap_or(usize::MAX)).map_err(|_| no_room())?;
    file.take(most.saturating_add(1)).read_to_end(&mut bytes).map_err(|error| match error.kind() {
        ErrorKind::OutOfMemory => no_room(),
        _ => Error::reading(path, &error),
    })?;
    Ok(Some(bytes).filter(|bytes| bytes.len() as u64 <= most))
}

/// Reads a text in UTF-8 of at most [`MOST_TEXT`] bytes.
///
/// # Errors
/// Those of [`Contents::of`], and [`Error::Read`] if it is no such text.
pub fn read_text(path: &Path) -> Result<String, Error> {
    let bytes = Contents::of(path, MOST_TEXT)?.bytes;
    String::from_utf8(bytes).map_err(|_| Error::reading(path, &"not a text in UTF-8"))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn files_up_to_the_limit_are_read_and_longer_ones_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        fs::write(&path, [7; 100]).unwrap();
        assert_eq!(Contents::of(&path, 100).unwrap().bytes, [7; 100]);
        assert!(matches!(Contents::of(&path, 99), Err(Error::Read { .. })));
        assert!(Contents::of_regular(&path, 100).is_ok());
        assert!(Contents::of(folder.path(), 100).unwrap_err().to_string().contains("is a folder"));
        let limits = Limits { memory: Some(99), ..Limits::megapixels(1) };
        assert!(matches!(Contents::of_pixels(&path, limits), Err(Error::OutOfMemory { needed: 100, .. })));
        assert!(matches!(Contents::within(&path, 100, Some(99)), Err(Error::OutOfMemory { needed: 100, .. })));
        assert_eq!(read_source(&[7; 100][..], "pipe", 100, Some(100)).unwrap(), [7; 100]);
        assert!(matches!(read_source(&[7; 100][..], "pipe", 200, Some(99)), Err(Error::OutOfMemory { .. })));
        assert!(read_source(&[7; 100][..], "pipe", 99, None).unwrap_err().to_string().starts_with("pipe: it has more"));
    }

    /// A sparse file tells a length that nobody could read.
    #[test]
    fn a_file_that_is_too_long_is_refused_before_it_is_read() {
        let file = tempfile::NamedTempFile::new().unwrap();
        file.as_file().set_len(1 << 38).unwrap();
        assert!(Contents::of(file.path(), MOST_TEXT).is_err());
        assert!(Contents::of_pixels(file.path(), Limits::default()).is_err());
    }

    #[cfg(unix)]
    #[test]
    fn devices_without_end_are_refused() {
        let zero = Path::new("/dev/zero");
        assert!(Contents::of_regular(zero, 100).unwrap_err().to_string().contains("not a regular file"));
        assert!(Contents::of(zero, 100).is_err());
        assert!(Contents::of_pixels(zero, Limits { pixels: 10, memory: None }).is_err());
        assert!(Contents::of_pixels(zero, Limits { pixels: 1 << 40, memory: Some(1 << 16) }).is_err());
    }
}
