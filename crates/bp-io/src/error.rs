//! What can go wrong with a file.

use std::{
    fmt::Display,
    path::{Path, PathBuf},
};

use bytesize::ByteSize;

/// Why a file could not be read or written. The variant says who can mend it.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The file is missing, broken or does not fit: another file is needed.
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
        /// Why it cannot be written.
        reason: String,
    },
    /// The caller asks for something that this path cannot be: an unknown ending, a value beyond the format, a file that is
    /// also an input.
    #[error("{}: {reason}", path.display())]
    Request {
        /// The path that the caller gave.
        path: PathBuf,
        /// What it cannot be.
        reason: String,
    },
    /// The folder that a file should go into is missing: the caller creates it or names another.
    #[error("cannot write {}: there is no folder {}; create it first", path.display(), folder.display())]
    MissingFolder {
        /// The file.
        path: PathBuf,
        /// Its folder.
        folder: PathBuf,
    },
    /// Reading the file takes more memory than there is.
    #[error("{}: reading it needs {}{}", path.display(), iec(*needed), but_only(*available))]
    OutOfMemory {
        /// The file.
        path: PathBuf,
        /// Bytes needed.
        needed: u64,
        /// Bytes available, where that is known.
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
    /// A file that cannot be read, for this reason.
    pub fn reading(path: &Path, reason: &dyn Display) -> Self {
        Self::Read { path: path.to_owned(), reason: reason.to_string() }
    }

    /// A file that cannot be written, for this reason.
    pub fn writing(path: &Path, reason: &dyn Display) -> Self {
        Self::Write { path: path.to_owned(), reason: reason.to_string() }
    }

    /// A path that cannot be what is asked of it, for this reason.
    pub fn request(path: &Path, reason: &dyn Display) -> Self {
        Self::Request { path: path.to_owned(), reason: reason.to_string() }
    }
}
