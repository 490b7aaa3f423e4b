//! The messages of rows that are passed together, one per edge.

use std::ops::Range;

use bp_core::{Error, Side, memory::Buffer};

use super::padded::Padded;
use crate::block::Block;

/// Messages by edge, each array `[row][..][entry]` with the entries of [`Lists`](super::lists::Lists). An edge has one slot,
/// which holds the message that was sent over it last. Only the edge between two patches has two: the same message for the
/// labels of either.
#[derive(Default)]
pub(crate) struct Messages {
    /// Edges inside pairs of columns.
    pub(crate) same: Buffer<Block>,
    /// Edges between pairs: lane i lies between lane i of plane 1 and lane i + 1 of plane 0, which may belong to the next
    /// patch. Lane -1 belongs to the patch before.
    pub(crate) next: Buffer<Padded>,
    /// Edges up from the nodes of each row, and those down from the last one, `[row][plane][entry]`.
    pub(crate) vertical: Buffer<Block>,
}

/// The bytes of the messages of so many rows with so many entries each.
pub(crate) fn bytes(rows: usize, entries: usize) -> u64 {
    let row = size_of::<Block>() + size_of::<Padded>();
    let vertical = 2 * size_of::<Block>();
    (entries as u64).saturating_mul((rows * row + (rows + 1) * vertical) as u64)
}

impl Messages {
    /// Makes room for the messages of so many rows with so many entries each.
    pub(crate) fn fit(&mut self, rows: usize, entries: usize) -> Result<(), Error> {
        let what = "messages";
        self.same.grow(what, rows.saturating_mul(entries), Block::ZERO)?;
        self.next.grow(what, rows.saturating_mul(entries), Padded::ZERO)?;
        self.vertical.grow(what, (2 * (rows + 1)).saturating_mul(entries), Block::ZERO)
    }

    /// The edges of the nodes of `plane` in a row, for these entries of all. Rows are counted from the first one.
    #[inline(always)]
    pub(crate) fn around(&mut self, at: &Place<'_>) -> Around<'_> {
        let &Place { entries, row, plane, range } = at;
        let inside = row * entries + range.start..row * entries + range.end;
        let (above, below) = self.vertical.split_at_mut(2 * (row + 1) * entries);
        Around {
            same: &mut self.same[inside.clone()],
            next: &mut self.next[inside],
            above: &mut above[(2 * row + plane) * entries..][range.clone()],
            below: &mut below[plane * entries..][range.clone()],
        }
    }

    /// The same, to be read.
    #[inline(always)]
    pub(crate) fn at(&self, at: &Place<'_>) -> Held<'_> {
        let &Place { entries, row, plane, range } = at;
        let inside = row * entries + range.start..row * entries + range.end;
        Held {
            same: &self.same[inside.clone()],
            next: &self.next[inside],
            below: &self.vertical[(2 * row + 2 + plane) * entries..][range.clone()],
        }
    }

    /// The edges up from both planes of a row.
    pub(crate) fn up_mut(&mut self, entries: usize, row: usize) -> &mut [Block] {
        &mut self.vertical[2 * row * entries..][..2 * entries]
    }

    /// The value of one edge of a lane in an entry, counted from the first one of all rows.
    pub(crate) fn value(&self, entries: usize, node: Entry, side: Side) -> u8 {
        let Entry { row, plane, entry, lane } = node;
        let inside = row * entries + entry;
        match (side, plane) {
            (Side::Right, 0) | (Side::Left, 1) => self.same[inside].0[lane],
            (Side::Left, _) => self.next[inside].lane(lane as isize - 1),
            (Side::Right, _) => self.next[inside].lane(lane as isize),
            (Side::Up, _) => self.vertical[(2 * row + plane) * entries + entry].0[lane],
            (Side::Down, _) => self.vertical[(2 * row + 2 + plane) * entries + entry].0[lane],
        }
    }

    /// The bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        self.same.bytes() + self.next.bytes() + self.vertical.bytes()
    }
}

/// Some entries of the nodes of a plane in a row.
pub(crate) struct Place<'a> {
    /// The number of entries of all patches.
    pub(crate) entries: usize,
    pub(crate) row: usize,
    pub(crate) plane: usize,
    /// The entries of the patch.
    pub(crate) range: &'a Range<usize>,
}

/// One node in one entry.
#[derive(Clone, Copy)]
pub(crate) struct Entry {
    pub(crate) row: usize,
    pub(crate) plane: usize,
    pub(crate) entry: usize,
    pub(crate) lane: usize,
}

/// The edges of the nodes of one plane of a patch in one row, `[entry]`.
pub(crate) struct Around<'a> {
    pub(crate) same: &'a mut [Block],
    pub(crate) next: &'a mut [Padded],
    pub(crate) above: &'a mut [Block],
    pub(crate) below: &'a mut [Block],
}

/// The messages that the nodes of one plane of a patch hold in one row, except those from above, `[entry]`.
pub(crate) struct Held<'a> {
    pub(crate) same: &'a [Block],
    pub(crate) next: &'a [Padded],
    pub(crate) below: &'a [Block],
}
