//! Segments: the parts of bands that workgroups go through row by row under the schedule `sweep`; see `segments.wgsl`.

use bp_core::BAND_ROWS;

use crate::layout::{Grid, VECTOR_BYTES, WORD_NODES};

/// The fewest and the most words that a segment keeps. With fewer, more is computed twice; with more, a row takes longer.
const FEWEST_WORDS: usize = 2;
const KEPT_WORDS: usize = 12;

/// Fewer segments than this leave a large GPU idle, so they become smaller. With twice as many, the finest grid of a common image no
/// longer fits an H200 at once, and its messages take a seventh more time.
const BUSY_SEGMENTS: usize = 64;

/// The most words that a segment computes: also those at either end which a band's rows spoil.
pub(crate) const MOST_WORDS: usize = KEPT_WORDS + 2 * BAND_ROWS.div_ceil(2 * WORD_NODES);

/// The messages of a segment that its workgroup keeps by itself. `pass_rows.wgsl` has the same number.
const OWN_PLANES: usize = 5;

/// The most bytes that the messages of all segments take. A dispatch has no more segments than that suffices for.
const MOST_OWN_BYTES: u64 = 64 << 20;

/// The words that a segment keeps, if so many bands have rows of so many words.
pub(crate) fn kept_words(bands: usize, words: usize) -> usize {
    (bands * words).div_ceil(BUSY_SEGMENTS).clamp(FEWEST_WORDS, KEPT_WORDS)
}

/// The bytes of the messages that the workgroup of a segment keeps.
pub(crate) fn own_bytes(grid: &Grid) -> u64 {
    (OWN_PLANES * grid.quads * MOST_WORDS.min(grid.words)) as u64 * VECTOR_BYTES
}

/// The bytes of the messages of the segments of a dispatch on this grid, if buffers may have so many bytes.
pub(crate) fn all_own_bytes(grid: &Grid, buffer_bytes: u64) -> u64 {
    let bands = grid.strips.iter().map(|strip| strip.rows.div_ceil(BAND_ROWS)).max().unwrap_or(0);
    let segments = bands * grid.words.div_ceil(kept_words(bands, grid.words));
    let one = own_bytes(grid);
    one * (MOST_OWN_BYTES.min(buffer_bytes) / one).min(segments as u64).max(1)
}
