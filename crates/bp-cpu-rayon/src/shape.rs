//! The memory layout of the values of a grid.

use bp_core::{Plan, Size};

/// Every row of lanes is a whole number of blocks. No vector is longer than a block.
pub(crate) const BLOCK: usize = 64;

/// The most lanes of a strip: their running minima stay in the L1 cache during the loop over all labels.
pub(crate) const STRIP: usize = 8 * BLOCK;

/// The fewest rows that are worth passing to another thread.
pub(crate) const MIN_ROWS: usize = 32;

/// Rows of a grid are split into two *planes* by column parity: lane i of plane p is column `2i + p`. All nodes of a
/// plane in one row have one checkerboard colour, and the four neighbours of consecutive lanes are consecutive lanes, so
/// a vector of nodes is one load everywhere. A plane holds values `[label][lane]`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shape {
    /// Size of the grid.
    pub(crate) size: Size,
    /// Number of labels.
    pub(crate) labels: usize,
    /// The distance in lanes from one label to the next: the lanes of a plane plus padding.
    pub(crate) lanes: usize,
}

impl Shape {
    /// The shape of a grid of `plan`.
    pub(crate) fn new(plan: &Plan, grid: usize) -> Self {
        let size = plan.size(grid);
        Self { size, labels: plan.model().labels(), lanes: lanes(size) }
    }

    /// Number of nodes of a plane in a row.
    pub(crate) fn nodes(&self, plane: usize) -> usize {
        (self.size.width + 1 - plane) / 2
    }

    /// Number of entries in one plane of a row.
    pub(crate) fn plane(&self) -> usize {
        self.labels * self.lanes
    }

    /// Number of entries in both planes of a row.
    pub(crate) fn row(&self) -> usize {
        2 * self.plane()
    }

    /// Splits the lanes of a plane into strips of whole blocks.
    pub(crate) fn strips(&self, plane: usize) -> impl Iterator<Item = Strip> + use<> {
        let lanes = self.nodes(plane).next_multiple_of(BLOCK);
        (0..lanes).step_by(STRIP).map(move |first| Strip { first, lanes: STRIP.min(lanes - first) })
    }

    /// The nodes of a row.
    pub(crate) fn columns(&self) -> impl Iterator<Item = Column> + use<> {
        (0..self.size.width).map(|x| Column { x, plane: x % 2, lane: x / 2 })
    }
}

/// Some consecutive lanes of a plane.
#[derive(Clone, Copy)]
pub(crate) struct Strip {
    pub(crate) first: usize,
    /// The number of lanes, at most [`STRIP`].
    pub(crate) lanes: usize,
}

impl Strip {
    /// The column of its first lane, in a row of this plane.
    pub(crate) fn column(self, at: PlaneRow) -> isize {
        (2 * self.first + at.plane) as isize
    }

    /// The values of the strip.
    #[inline(always)]
    pub(crate) fn of(self, values: &[u8]) -> &[u8] {
        &values[self.first..self.first + self.lanes]
    }
}

/// A column and its position in the layout.
#[derive(Clone, Copy)]
pub(crate) struct Column {
    pub(crate) x: usize,
    pub(crate) plane: usize,
    pub(crate) lane: usize,
}

/// The nodes of one plane in one row.
#[derive(Clone, Copy)]
pub(crate) struct PlaneRow {
    pub(crate) plane: usize,
    pub(crate) y: usize,
}

impl PlaneRow {
    /// The checkerboard colour of these nodes.
    pub(crate) fn colour(self) -> usize {
        (self.plane + self.y) % 2
    }
}

/// The start of a block of nodes in a row.
#[derive(Clone, Copy)]
pub(crate) struct BlockStart {
    pub(crate) plane: usize,
    /// Its first lane.
    pub(crate) lane: usize,
}

/// The lanes of a plane, padded to whole blocks. If labels would lie a multiple of 256 bytes apart, one block is added,
/// because otherwise they would share too few sets of the cache.
pub(crate) fn lanes(size: Size) -> usize {
    let blocks = size.width.div_ceil(2).div_ceil(BLOCK);
    BLOCK * if blocks.is_multiple_of(4) { blocks + 1 } else { blocks }
}

/// Writes a value for every second pixel, starting with the first. These are the pixels of one plane.
#[inline(always)]
pub(crate) fn every_second(plane: &mut [u8], pixels: &[[u8; 3]], value: impl Fn(&[u8; 3]) -> u8) {
    plane.iter_mut().zip(pixels.iter().step_by(2)).for_each(|(out, pixel)| *out = value(pixel));
}

/// Writes a row block by block. `values(x, out)` computes the values of consecutive columns from x on, which alternate
/// between the even and the odd plane.
#[inline(always)]
pub(crate) fn deal(even: &mut [u8], odd: &mut [u8], values: impl Fn(usize, &mut [u8])) {
    let mut block = [0; 2 * BLOCK];
    for (index, (even, odd)) in even.chunks_mut(BLOCK).zip(odd.chunks_mut(BLOCK).chain([&mut [][..]])).enumerate() {
        values(2 * BLOCK * index, &mut block[..even.len() + odd.len()]);
        even.iter_mut().zip(block.iter().step_by(2)).for_each(|(out, &value)| *out = value);
        odd.iter_mut().zip(block[1..].iter().step_by(2)).for_each(|(out, &value)| *out = value);
    }
}
