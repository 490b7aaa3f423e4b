//! Reads alignments of rows from files.

use std::path::Path;

use bp_core::Alignment;

use crate::{Contents, Error, read::MOST_DESCRIPTION};

/// Reads an alignment as JSON.
///
/// # Errors
/// [`Error::Read`].
pub fn read_alignment(path: &Path) -> Result<Alignment, Error> {
    let bytes = Contents::of(path, MOST_DESCRIPTION)?.bytes;
    serde_json::from_slice(&bytes).map_err(|error| Error::reading(path, &format!("not an alignment: {error}")))
}
