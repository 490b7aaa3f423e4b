//! What a pair was cut into, as files describe it.

use bp_core::Tiling;
use serde::{Deserialize, Serialize};

/// What a pair was cut into.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Tiles {
    /// Beside each other.
    pub columns: usize,
    /// Above each other.
    pub rows: usize,
    /// The widest tile in pixels.
    pub width: usize,
    /// The highest tile in pixels.
    pub height: usize,
    /// How near the answer is to the whole image's.
    pub answer: String,
}

impl Tiles {
    /// Describes a tiling; none where it is the whole image.
    pub(crate) fn of(tiling: &Tiling) -> Option<Self> {
        let ((columns, rows), size) = (tiling.counts(), tiling.tile_size());
        let answer = tiling.likeness().name().to_owned();
        (!tiling.is_whole()).then_some(Self { columns, rows, width: size.width, height: size.height, answer })
    }
}
