//! The tiles of a pair, as files describe them.

use bp_core::Tiling;
use serde::{Deserialize, Serialize};

/// How close the answer of tiles is to that of the whole image.
pub(crate) const ANSWER: &str = "nearly the whole image's answer";

/// The tiles that a pair was cut into.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Tiles {
    /// Number of columns.
    pub columns: usize,
    /// Number of rows.
    pub rows: usize,
    /// Width of the widest tile in pixels.
    pub width: usize,
    /// Height of the highest tile in pixels.
    pub height: usize,
    /// How close the answer is to that of the whole image, in words.
    pub answer: String,
}

impl Tiles {
    /// Describes a tiling; `None` if its only tile is the whole image.
    pub(crate) fn of(tiling: &Tiling) -> Option<Self> {
        let ((columns, rows), size) = (tiling.counts(), tiling.tile_size());
        let answer = ANSWER.to_owned();
        (!tiling.is_whole()).then_some(Self { columns, rows, width: size.width, height: size.height, answer })
    }
}
