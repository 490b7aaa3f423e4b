//! Patches: the columns of a band whose nodes share what they are computed from.

use std::ops::Range;

use crate::{Node, Size};

/// Up to 64 columns of rows that are passed together: those of a band, or those around a seam. Under
/// [`Settings::label_sets`](crate::Settings::label_sets) its nodes share a [`LabelSet`](crate::LabelSet).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Patch {
    /// Its columns.
    pub columns: Range<usize>,
    /// Its rows.
    pub rows: Range<usize>,
}

impl Patch {
    /// The columns of a patch; the last one of a row may have fewer.
    pub const COLUMNS: usize = 64;

    /// How many nodes of the coarser grid are looked at beyond the parents, on every side.
    const MARGIN: usize = 2;

    /// The patches of these rows, from left to right.
    pub fn all(width: usize, rows: Range<usize>) -> impl ExactSizeIterator<Item = Self> {
        (0..width.div_ceil(Self::COLUMNS)).map(move |index| {
            let first = index * Self::COLUMNS;
            Self { columns: first..width.min(first + Self::COLUMNS), rows: rows.clone() }
        })
    }

    /// Its nodes, row by row.
    pub fn nodes(&self) -> impl Iterator<Item = Node> + use<> {
        let columns = self.columns.clone();
        self.rows.clone().flat_map(move |y| columns.clone().map(move |x| Node { x, y }))
    }

    /// The patch of the next coarser grid, of size `coarser`, whose labels decide the set: the parents and two more nodes on
    /// every side, where there are any.
    #[must_use]
    pub fn region(&self, coarser: Size) -> Self {
        let around = |range: &Range<usize>, end: usize| {
            (range.start / 2).saturating_sub(Self::MARGIN)..end.min((range.end - 1) / 2 + 1 + Self::MARGIN)
        };
        Self { columns: around(&self.columns, coarser.width), rows: around(&self.rows, coarser.height) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patches_cover_their_rows_and_look_two_nodes_beyond_the_parents() {
        let patches: Vec<_> = Patch::all(150, 32..64).collect();
        assert_eq!(patches.len(), 3);
        assert_eq!(patches[2], Patch { columns: 128..150, rows: 32..64 });
        let coarser = Size { width: 75, height: 35 };
        assert_eq!(patches[1].region(coarser), Patch { columns: 30..66, rows: 14..34 });
        assert_eq!(patches[2].region(coarser), Patch { columns: 62..75, rows: 14..34 });
        let edge = Patch { columns: 0..64, rows: 52..68 };
        assert_eq!(edge.region(coarser), Patch { columns: 0..34, rows: 24..35 });
        assert_eq!(patches[0].nodes().count(), 64 * 32);
    }
}
