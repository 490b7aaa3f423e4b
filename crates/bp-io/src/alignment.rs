//! Reads alignments of rows from files.

use std::path::Path;

use bp_core::Alignment;

use crate::{Error, Limits, images::read_limited};

/// Reads an alignment as JSON.
///
/// # Errors
/// [`Error::Read`].
pub fn read_alignment(path: &Path) -> Result<Alignment, Error> {
    let bytes = read_limited(path, Limits { pixels: 0, memory: None })?;
    serde_json::from_slice(&bytes).map_err(|error| Error::reading(path, &format!("not an alignment: {error}")))
}
