//! The memory layout of the values of a grid.

use std::ops::Range;

use bp_core::{Plan, Size};
use fearless_simd::{Simd, SimdBase, u8x64};

use crate::block::{Block, LANES};

/// The lanes of the widest vector. Rows of lanes that are made from images have so many more on both sides.
pub(crate) const WIDEST: usize = 64;

/// The fewest rows that are worth passing to another thread.
pub(crate) const MIN_ROWS: usize = 32;

/// Rows of a grid are split into two *planes* by column parity: lane i of plane p is column `2i + p`. All nodes of a
/// plane in one row have one checkerboard colour, and the four neighbours of consecutive lanes are consecutive lanes.
/// Planes are cut into [`Block`]s. A row holds values `[plane][block][label][lane]`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shape {
    /// Size of the grid.
    pub(crate) size: Size,
    /// Number of labels.
    pub(crate) labels: usize,
    /// Number of blocks of nodes of a plane in a row.
    pub(crate) blocks: usize,
}

impl Shape {
    /// The shape of a grid of `plan`.
    pub(crate) fn new(plan: &Plan, grid: usize) -> Self {
        let size = plan.size(grid);
        Self { size, labels: plan.model().labels(), blocks: size.width.div_ceil(2).div_ceil(LANES) }
    }

    /// Number of nodes of a plane in a row.
    pub(crate) fn nodes(&self, plane: usize) -> usize {
        (self.size.width + 1 - plane) / 2
    }

    /// The lanes of a plane plus padding.
    pub(crate) fn lanes(&self) -> usize {
        LANES * self.blocks
    }

    /// Number of [`Block`]s of one plane of a row, with all labels.
    pub(crate) fn plane(&self) -> usize {
        self.labels * self.blocks
    }

    /// Number of [`Block`]s of both planes of a row.
    pub(crate) fn row(&self) -> usize {
        2 * self.plane()
    }

    /// Where a plane holds the labels of a block.
    pub(crate) fn block(&self, index: usize) -> Range<usize> {
        self.labels * index..self.labels * (index + 1)
    }

    /// The labels of a block of both planes of a row.
    pub(crate) fn blocks_of<'a, T>(&self, row: &'a mut [Block<T>], index: usize) -> [&'a mut [Block<T>]; 2] {
        let (even, odd) = row.split_at_mut(self.plane());
        [even, odd].map(|plane| &mut plane[self.block(index)])
    }

    /// The nodes of a row.
    pub(crate) fn columns(&self) -> impl Iterator<Item = Column> + use<> {
        (0..self.size.width).map(|x| Column { x, plane: x % 2, lane: x / 2 })
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

/// Consecutive columns of a row. Where a row ends sooner, the rest is arbitrary.
pub(crate) type Piece = [u8; 2 * WIDEST];

/// Writes a row piece by piece. `values(x, columns, piece)` computes the values of so many consecutive columns from x on, which
/// alternate between the even and the odd plane.
#[inline(always)]
pub(crate) fn deal<S: Simd>(simd: S, even: &mut [u8], odd: &mut [u8], values: impl Fn(usize, usize, &mut Piece)) {
    let mut piece = [0; 2 * WIDEST];
    for (index, (even, odd)) in even.chunks_mut(WIDEST).zip(odd.chunks_mut(WIDEST).chain([&mut [][..]])).enumerate() {
        values(2 * WIDEST * index, even.len() + odd.len(), &mut piece);
        let [first, second] = [0, WIDEST].map(|from| u8x64::from_slice(simd, &piece[from..from + WIDEST]));
        let (evens, odds) = first.deinterleave(second);
        even.copy_from_slice(&evens.as_slice()[..even.len()]);
        odd.copy_from_slice(&odds.as_slice()[..odd.len()]);
    }
}
