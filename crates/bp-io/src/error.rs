//! Errors about files.

use std::{
    fmt::Display,
    path::{Path, PathBuf},
};

use bytesize::ByteSize;

/// Why a file could not be read or written. The variant says who can fix it.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The file is missing, broken or unsuitable: another file is needed.
    #[error("{}: {reason}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// The file cannot be written: its folder, its permissions or the disk must change.
    #[error("cannot write {}: {reason}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The reason.
        reason: String,
    },
    /// The path does not suit the request: an unknown extension, a value beyond the format, a file that is also an
    /// input.
    #[error("{}: {reason}", path.display())]
    Request {
        /// The path that the caller gave.
        path: PathBuf,
        /// The reason.
        reason: String,
    },
    /// The folder of an output is missing: the caller must create it or name another.
    #[error("cannot write {}: there is no folder {}; create it first", path.display(), folder.display())]
    MissingFolder {
        /// The file.
        path: PathBuf,
        /// Its folder.
        folder: PathBuf,
    },
    /// Reading the file needs more memory than is available.
    #[error("{}: reading it needs {}{}", path.display(), iec(*needed), but_only(*available))]
    OutOfMemory {
        /// The file.
        path: PathBuf,
        /// Bytes needed.
        needed: u64,
        /// Bytes available, if known.
        available: Option<u64>,
    },
}

fn iec(bytes: u64) -> String {
    ByteSize(bytes).display().iec().to_string()
}

fn but_only(available: Option<u64>) -> String {
    available.map_or_else(String::new, |bytes| format!(", but only {} is available", iec(bytes)))
}

impl Error {
    /// [`Error::Read`] with this reason.
    pub fn reading(path: &Path, reason: &dyn Display) -> Self {
        Self::Read { path: path.to_owned(), reason: reason.to_string() }
    }

    /// [`Error::Write`] with this reason.
    pub fn writing(path: &Path, reason: &dyn Display) -> Self {
        Self::Write { path: path.to_owned(), reason: reason.to_string() }
    }

    /// [`Error::Request`] with this reason.
    pub fn request(path: &Path, reason: &dyn Display) -> Self {
        Self::Request { path: path.to_owned(), reason: reason.to_string() }
    }
}
