//! Messages, one per edge.

use std::ops::Range;

use bp_core::{Error, IsStopped, Node, Plan, Side, memory::Buffer};
use fearless_simd::{Simd, SimdBase};

use crate::{
    block::{Block, Bytes, LANES},
    layout::Layout,
    shape::{Column, PlaneRow, Shape},
};

/// The planes of a row: two with the edges up from the two planes of nodes, one with the edges inside pairs of columns,
/// and one with those between pairs. A plane holds `[block][label]`.
///
/// Lane i of the edges between pairs joins the nodes of even columns in lane i with those of odd columns in lane i - 1.
/// So for odd columns these values are *moved*: a block of nodes finds them one lane further on, the last one in the
/// next block.
const PLANES: usize = 4;

/// One message per edge, updated in place. One is enough: a node that sends over an edge has just read the message that
/// came the other way, and the other end reads the new one before it answers. Row y of storage holds the edges up from
/// row y, those inside row y, and a block of every label to work with. A row of zeros follows the last one.
pub(crate) struct Edges {
    values: Buffer<Block>,
}

impl Edges {
    /// Allocates room for the edges of `grid`, which is also enough for every coarser grid.
    pub(crate) fn new(plan: &Plan, grid: usize, is_stopped: IsStopped<'_>) -> Result<Self, Error> {
        let blocks = volume(&Shape::new(plan, grid));
        Ok(Self { values: Buffer::filled_unless(is_stopped, "messages", blocks, Block::ZERO)? })
    }

    /// Allocates nothing.
    pub(crate) fn none() -> Self {
        Self { values: Buffer::default() }
    }

    /// The rows of a grid.
    pub(crate) fn rows<'a>(&'a self, layout: &'a Layout) -> Rows<'a> {
        Rows { layout, values: self.values.get(..volume(layout)).unwrap_or_default() }
    }

    /// The rows of a grid, which threads can split by [`row`].
    pub(crate) fn rows_mut(&mut self, layout: &Layout) -> &mut [Block] {
        self.values.get_mut(..volume(layout)).unwrap_or_default()
    }

    /// The bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        self.values.bytes()
    }
}

/// Bytes that the edges of a grid need.
pub(crate) fn bytes(shape: &Shape) -> u64 {
    (volume(shape) as u64).saturating_mul(size_of::<Block>() as u64)
}

/// The blocks of all rows.
fn volume(shape: &Shape) -> usize {
    row(shape).saturating_mul(shape.size.height + 1)
}

/// The blocks of a row.
pub(crate) fn row(shape: &Shape) -> usize {
    PLANES * shape.plane() + shape.labels
}

/// Reads the messages of a whole grid.
#[derive(Clone, Copy)]
pub(crate) struct Rows<'a> {
    layout: &'a Layout,
    values: &'a [Block],
}

/// The messages that the nodes of a plane in a row received from one side.
#[derive(Clone, Copy)]
pub(crate) struct Received<'a> {
    /// `[block][label]`.
    values: &'a [Block],
    labels: usize,
    /// Whether they lie one lane further on.
    is_moved: bool,
}

/// The same for one block of nodes.
#[derive(Clone, Copy)]
pub(crate) struct OfBlock<'a> {
    values: &'a [Block],
    /// The next block, if values are moved. Otherwise empty.
    next: &'a [Block],
}

impl<'a> Rows<'a> {
    /// The messages that the nodes of `plane` in row `y` received from `side`. `None` if the row has no neighbours on that side.
    /// Lanes without a neighbour hold arbitrary values.
    pub(crate) fn towards(&self, side: Side, plane: usize, y: usize) -> Option<Received<'a>> {
        let rows = &self.values[row(self.layout) * y..];
        received(self.layout, rows, PlaneRow { plane, y })[slot(side, plane)]
    }
}

impl<'a> Received<'a> {
    /// Those of the nodes one lane before or behind these.
    pub(crate) fn moved(self, by: isize) -> Self {
        Self { is_moved: by + isize::from(self.is_moved) != 0, ..self }
    }

    /// Whether they lie one lane further on.
    pub(crate) fn is_moved(&self) -> bool {
        self.is_moved
    }

    /// The messages of a block of nodes.
    pub(crate) fn block(&self, index: usize) -> OfBlock<'a> {
        let (values, behind) = self.values[self.labels * index..].split_at(self.labels);
        // Behind the last block are no nodes, so any values will do.
        let next = if self.is_moved { behind.get(..self.labels).unwrap_or(values) } else { &[] };
        OfBlock { values, next }
    }

    /// The entry for a label in the message of one node.
    pub(crate) fn value(&self, label: usize, lane: usize) -> u8 {
        let lane = lane + usize::from(self.is_moved);
        self.values[self.labels * (lane / LANES) + label].0[lane % LANES]
    }
}

impl<'a> OfBlock<'a> {
    /// Values that no mask lets through.
    pub(crate) fn any(values: &'a [Block]) -> Self {
        Self { values, next: values }
    }

    /// The same for these labels only.
    pub(crate) fn part(self, labels: Range<usize>) -> Self {
        Self { values: &self.values[labels.clone()], next: self.next.get(labels).unwrap_or_default() }
    }

    /// The entries for a label.
    #[inline(always)]
    pub(crate) fn load<S: Simd>(&self, simd: S, label: usize) -> Bytes<S> {
        if self.next.is_empty() { self.load_in_place(simd, label) } else { self.load_moved(simd, label) }
    }

    /// As [`OfBlock::load`], if values are moved.
    #[inline(always)]
    pub(crate) fn load_moved<S: Simd>(&self, simd: S, label: usize) -> Bytes<S> {
        self.load_in_place(simd, label).slide::<1>(self.next[label].load(simd))
    }

    /// As [`OfBlock::load`], if values are not moved.
    #[inline(always)]
    pub(crate) fn load_in_place<S: Simd>(&self, simd: S, label: usize) -> Bytes<S> {
        self.values[label].load(simd)
    }
}

/// The slot in which a node of `plane` keeps its edge to `side`.
pub(crate) fn slot(side: Side, plane: usize) -> usize {
    match (side, plane) {
        (Side::Right, 0) | (Side::Left, 1) => 0,
        (Side::Left | Side::Right, _) => 1,
        (Side::Up, _) => 2,
        (Side::Down, _) => 3,
    }
}

/// The messages that the nodes of a plane in a row received in each slot; see [`Slots`]. `rows` start with that row. `None` if the row
/// has no neighbours there.
pub(crate) fn received<'a>(layout: &Layout, rows: &'a [Block], at: PlaneRow) -> [Option<Received<'a>>; 4] {
    let (len, below) = (layout.plane(), row(layout));
    let starts = [2 * len, 3 * len, at.plane * len, below + at.plane * len];
    let [same, next, up, down] =
        starts.map(|start| Received { values: &rows[start..start + len], labels: layout.labels, is_moved: false });
    [
        Some(same),
        Some(Received { is_moved: at.plane == 1, ..next }),
        Some(up).filter(|_| layout.joined_above(at.y)),
        Some(down).filter(|_| layout.joined_above(at.y + 1)),
    ]
}

/// Copies the messages received from `side`, `[height][width][labels]`. `received` has those of nodes of each colour.
pub(crate) fn read_messages(plan: &Plan, received: [Rows<'_>; 2], side: Side, messages: &mut [u8]) {
    let layout = received[0].layout;
    let nodes = (0..).flat_map(|y| layout.columns().map(move |column| (column, y)));
    for ((Column { x, plane, lane }, y), out) in nodes.zip(messages.chunks_exact_mut(layout.labels)) {
        let there = plan.neighbour(0, Node { x, y }, side).is_some();
        let received = if there { received[(x + y) % 2].towards(side, plane, y) } else { None };
        for (label, out) in out.iter_mut().enumerate() {
            *out = received.map_or(0, |received| received.value(label, lane));
        }
    }
}

/// The edges of the nodes of a plane in a row.
pub(crate) struct Slots<'a> {
    /// In order: to the neighbour in the same pair of columns, in the next pair, above and below, each `[block][label]`.
    pub(crate) values: [&'a mut [Block]; 4],
    /// If the second slot's values are moved, one block of every label to work with.
    pub(crate) moving: Option<&'a mut [Block]>,
}

/// The edges of the nodes of `plane` in the first row of `rows`, which also needs the row after it.
pub(crate) fn slots<'a>(shape: &Shape, rows: &'a mut [Block], plane: usize) -> Slots<'a> {
    let len = shape.plane();
    let (row, below) = rows.split_at_mut(self::row(shape));
    let (above, inside) = row.split_at_mut(2 * len);
    let (same, next) = inside.split_at_mut(len);
    let (next, room) = next.split_at_mut(len);
    let values = [same, next, &mut above[plane * len..][..len], &mut below[plane * len..][..len]];
    Slots { values, moving: (plane == 1).then_some(room) }
}

/// Copies the edges of the nodes of `plane` in the first row.
pub(crate) fn copy(shape: &Shape, from: &[Block], to: &mut [Block], plane: usize) {
    let (len, row) = (shape.plane(), row(shape));
    for start in [plane * len, 2 * len, 3 * len, row + plane * len] {
        to[start..start + len].copy_from_slice(&from[start..start + len]);
    }
}
