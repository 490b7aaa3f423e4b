//! Files as the experiments write them.

use std::{fmt::Display, io::Write, path::Path};

use bp_io::Files;
pub use bp_io::{Limits as PixelLimit, hex, pixels_sha256, read_image, read_map, read_stored_grey};
use serde::Serialize;

use crate::failure::Failure;

/// Writes a file whole or not at all; `write` fills it.
pub fn write_whole<E: Display>(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> Result<(), E>,
) -> Result<(), Failure> {
    Ok(Files::default().whole(path, write)?)
}

/// Writes a text.
pub fn write_text(path: &Path, text: &str) -> Result<(), Failure> {
    Ok(Files::default().text(path, text)?)
}

/// Writes a value as JSON that people can read.
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<(), Failure> {
    Ok(Files::default().json(path, value)?)
}

/// The text of such a file.
pub fn json_text(path: &Path, value: &impl Serialize) -> Result<String, Failure> {
    let text = serde_json::to_string_pretty(value).map_err(|error| Failure::writing(path, &error))?;
    Ok(text + "\n")
}

/// Writes a file that is not there yet.
pub fn write_new(path: &Path, contents: impl AsRef<[u8]>) -> Result<(), Failure> {
    Ok(Files::default().new_file(path, contents)?)
}

/// Fails where no file could be written at `path`.
pub fn check_writable(path: &Path) -> Result<(), Failure> {
    Ok(Files::default().check_writable(path)?)
}

/// Fails where there is a file at `path`.
pub fn check_new(path: &Path) -> Result<(), Failure> {
    Ok(bp_io::check_new(path)?)
}

/// Creates a folder and those above it.
pub fn create_folder(path: &Path) -> Result<(), Failure> {
    Ok(bp_io::create_folder(path)?)
}
