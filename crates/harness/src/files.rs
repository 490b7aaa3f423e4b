//! Reads and writes the files of the experiments.

use std::path::Path;

use bp_io::Files;
pub(crate) use bp_io::{hex, pixels_sha256};
use serde::Serialize;

use crate::failure::Failure;

/// The files of a folder, in which no link is followed: another user of the folder may have made it.
pub(crate) fn below(folder: &Path) -> Files {
    Files::default().owning(folder)
}

/// Writes a text.
pub(crate) fn write_text(path: &Path, text: &str) -> Result<(), Failure> {
    Ok(Files::default().text(path, text)?)
}

/// Writes a value as JSON that people can read.
pub(crate) fn write_json(path: &Path, value: &impl Serialize) -> Result<(), Failure> {
    Ok(Files::default().json(path, value)?)
}

/// The text that [`write_json`] writes.
pub(crate) fn json_text(path: &Path, value: &impl Serialize) -> Result<String, Failure> {
    let text = serde_json::to_string_pretty(value).map_err(|error| Failure::writing(path, &error))?;
    Ok(text + "\n")
}

/// Writes a new file; fails if it exists.
pub(crate) fn write_new(path: &Path, contents: impl AsRef<[u8]>) -> Result<(), Failure> {
    Ok(Files::default().new_file(path, contents)?)
}

/// Fails if a file exists at `path`.
pub(crate) fn check_new(path: &Path) -> Result<(), Failure> {
    Ok(bp_io::check_new(path)?)
}

/// Creates a folder and its parents.
pub(crate) fn create_folder(path: &Path) -> Result<(), Failure> {
    Ok(bp_io::create_folder(path)?)
}
