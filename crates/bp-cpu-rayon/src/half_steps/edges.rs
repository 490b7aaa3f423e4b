//! Messages, one per edge.

use bp_core::{Error, Plan, Side};

use crate::{
    layout::Layout,
    lines::Lines,
    shape::{BLOCK, Shape},
};

/// The planes of a row: two with the edges up from the two planes of nodes, one with the edges inside pairs of columns,
/// and one with those between pairs.
const PLANES: usize = 4;

/// One message per edge, updated in place. One is enough: a node that sends over an edge has just read the message that
/// came the other way, and the other end reads the new one before it answers. Row y of storage holds the edges up from
/// row y and those inside row y. A row of zeros follows the last one.
pub(crate) struct Edges {
    values: Lines<u8>,
}

impl Edges {
    /// Allocates room for the edges of `grid`, which is also enough for every coarser grid.
    pub(crate) fn new(plan: &Plan, grid: usize) -> Result<Self, Error> {
        Ok(Self { values: Lines::new("messages", bytes(&Shape::new(plan, grid)))? })
    }

    /// Allocates nothing.
    pub(crate) fn none() -> Self {
        Self { values: Lines::none() }
    }

    /// The rows of a grid.
    pub(crate) fn rows<'a>(&'a self, layout: &'a Layout) -> Rows<'a> {
        Rows { layout, values: self.values.get(..bytes(layout)).unwrap_or_default() }
    }

    /// The rows of a grid, which threads can split by [`row_bytes`].
    pub(crate) fn rows_mut(&mut self, layout: &Layout) -> &mut [u8] {
        self.values.get_mut(..bytes(layout)).unwrap_or_default()
    }

    /// The bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        self.values.bytes()
    }
}

/// Bytes that the edges of a grid need.
pub(crate) fn bytes(shape: &Shape) -> usize {
    row_bytes(shape).saturating_mul(shape.size.height + 1)
}

/// Bytes of a row.
pub(crate) fn row_bytes(shape: &Shape) -> usize {
    PLANES * plane(shape)
}

/// The bytes of a plane. It has one block more than its nodes need, because in the edges between pairs the nodes of
/// plane 1 reach one lane further.
fn plane(shape: &Shape) -> usize {
    shape.plane() + BLOCK
}

/// Reads the messages of a whole grid.
#[derive(Clone, Copy)]
pub(crate) struct Rows<'a> {
    layout: &'a Layout,
    values: &'a [u8],
}

impl<'a> Rows<'a> {
    /// The messages that the nodes of `plane` in row `y` received from `side`, `[label][lane]`. `None` if the row has no
    /// neighbours on that side. Lanes without a neighbour hold arbitrary values.
    pub(crate) fn towards(&self, side: Side, plane: usize, y: usize) -> Option<&'a [u8]> {
        self.towards_moved(side, plane, y, 0)
    }

    /// The same from so many lanes further on. Before the first lane lie arbitrary values.
    pub(crate) fn towards_moved(&self, side: Side, plane: usize, y: usize, moved: isize) -> Option<&'a [u8]> {
        let (row, index, shift) = match (side, plane) {
            (Side::Up, _) => (y, plane, 0),
            (Side::Down, _) => (y + 1, plane, 0),
            (Side::Right, 0) | (Side::Left, 1) => (y, 2, 0),
            (Side::Left, _) => (y, 3, 0),
            (Side::Right, _) => (y, 3, 1),
        };
        let bytes = self::plane(self.layout);
        let joined = matches!(side, Side::Left | Side::Right) || self.layout.joined_above(row);
        let start = (PLANES * row + index) * bytes + shift;
        let start = start.checked_add_signed(moved).filter(|_| joined)?;
        Some(&self.values[start..(start + bytes).min(self.values.len())])
    }
}

/// The edges of the nodes of `plane` in the first row of `rows`, which also needs the row after it. In order: to the
/// neighbour in the same pair of columns, in the next pair, above and below, each `[label][lane]`.
pub(crate) fn slots<'a>(shape: &Shape, rows: &'a mut [u8], plane: usize) -> [&'a mut [u8]; 4] {
    let bytes = self::plane(shape);
    let (row, below) = rows.split_at_mut(PLANES * bytes);
    let (above, inside) = row.split_at_mut(2 * bytes);
    let (same, next) = inside.split_at_mut(bytes);
    let above = &mut above[plane * bytes..][..bytes];
    let below = &mut below[plane * bytes..][..bytes];
    [same, &mut next[plane..], above, below]
}

/// Copies the edges of the nodes of `plane` in the first row.
pub(crate) fn copy(shape: &Shape, from: &[u8], to: &mut [u8], plane: usize) {
    let bytes = self::plane(shape);
    for index in [plane, 2, 3, PLANES + plane] {
        let range = index * bytes..(index + 1) * bytes;
        to[range.clone()].copy_from_slice(&from[range]);
    }
}
