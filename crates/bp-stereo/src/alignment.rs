//! The alignment of a camera: measured once, for all its pairs.

use std::path::Path;

use bp_core::{Alignment, StereoPair, survey::Survey};
use bp_io::Files;

use crate::{Align, Error, Watch};

/// The most pairs to measure.
const PAIRS: usize = 10;

/// Measures one pair after another until enough points agree on one, and writes the alignment to a file, if one is given.
/// [`Align::Off`] if there is none among the first ten pairs; `watch` then receives a warning about the file.
///
/// # Errors
/// [`Error::File`] for the file, and [`Error::Stopped`]. Pairs with an error are passed over.
pub fn align_camera(
    pairs: impl Iterator<Item = Result<StereoPair, Error>>,
    file: Option<(&Files, &Path)>,
    watch: &Watch<'_>,
) -> Result<Align, Error> {
    let found = pairs.take(PAIRS).flatten().find_map(|pair| Alignment::find(&pair, &Survey::coarse(&pair).ok()?));
    watch.check()?;
    match (found, file) {
        (Some(alignment), Some((files, path))) => files.json(path, &alignment)?,
        (None, Some((_, path))) => watch.warn(&not_aligned(path)),
        (_, None) => {}
    }
    Ok(found.map_or(Align::Off, Align::Known))
}

/// Why the file of a camera is missing, as a warning.
pub(crate) fn not_aligned(path: &Path) -> String {
    format!("{} is not written: rows are not aligned, because too few points of the images agree", path.display())
}
