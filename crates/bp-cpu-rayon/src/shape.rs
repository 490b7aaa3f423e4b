//! Where the values of a grid lie.

use bp_core::{Plan, Size};

/// Every row of lanes is a whole number of blocks; no vector is longer.
pub(crate) const BLOCK: usize = 64;

/// Lanes whose running minima stay in the first cache while all their labels pass by.
pub(crate) const STRIP: usize = 8 * BLOCK;

/// Fewest rows that are worth handing to another thread.
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
    /// Lanes from one label to the next: those of a plane, and padding.
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

    /// Entries of a plane of a row.
    pub(crate) fn plane(&self) -> usize {
        self.labels * self.lanes
    }

    /// Entries of both planes of a row.
    pub(crate) fn row(&self) -> usize {
        2 * self.plane()
    }

    /// The lanes of a plane in strips: where each starts, and how many lanes it has, whole blocks.
    pub(crate) fn strips(&self, plane: usize) -> impl Iterator<Item = (usize, usize)> + use<> {
        let lanes = self.nodes(plane).next_multiple_of(BLOCK);
        (0..lanes).step_by(STRIP).map(move |at| (at, STRIP.min(lanes - at)))
    }

    /// The nodes of a row: column, plane and lane.
    pub(crate) fn columns(&self) -> impl Iterator<Item = (usize, usize, usize)> + use<> {
        (0..self.size.width).map(|x| (x, x % 2, x / 2))
    }
}

/// Lanes of a plane, padded to whole blocks; where labels would lie a multiple of 256 bytes apart, they would share few
/// of a cache's sets, so there is one block more.
pub(crate) fn lanes(size: Size) -> usize {
    let blocks = size.width.div_ceil(2).div_ceil(BLOCK);
    BLOCK * if blocks.is_multiple_of(4) { blocks + 1 } else { blocks }
}

/// Writes a value of every second pixel: those of one plane, where `pixels` start with its first.
#[inline(always)]
pub(crate) fn every_second(plane: &mut [u8], pixels: &[[u8; 3]], value: impl Fn(&[u8; 3]) -> u8) {
    plane.iter_mut().zip(pixels.iter().step_by(2)).for_each(|(out, pixel)| *out = value(pixel));
}
