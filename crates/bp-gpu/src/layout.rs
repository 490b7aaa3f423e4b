//! The layout of a plan's values in memory.

use std::ops::Range;

use bp_core::{BAND_ROWS, Error, Node, Plan, Schedule, Size};

use crate::Limits;

/// The number of nodes of one colour whose bytes share a word.
pub(crate) const WORD_NODES: usize = 4;
/// The number of labels that share a vector.
const QUAD_LABELS: usize = 4;
/// The bytes of a vector: four labels at four nodes.
pub(crate) const VECTOR_BYTES: u64 = 16;

/// Rows of a grid that have their own buffers, so that no buffer is larger than a device allows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Strip {
    /// First row.
    pub(crate) first: usize,
    /// How many rows.
    pub(crate) rows: usize,
}

/// A grid cut into strips.
#[derive(Clone, Debug)]
pub(crate) struct Grid {
    pub(crate) size: Size,
    /// Words in a row of a plane.
    pub(crate) words: usize,
    /// Quads of labels.
    pub(crate) quads: usize,
    /// The bytes of a sum kept for the coarser grid: 2, 4, or 0 if none are kept.
    pub(crate) sum_bytes: usize,
    pub(crate) strips: Vec<Strip>,
}

impl Grid {
    fn new(plan: &Plan, grid: usize) -> Self {
        let size = plan.size(grid);
        let sum_bytes = if plan.keeps_sums(grid) { plan.sum_bytes(grid).clamp(2, 4) } else { 0 };
        let quads = plan.model().labels().div_ceil(QUAD_LABELS);
        let words = size.width.div_ceil(2 * WORD_NODES);
        Self { size, words, quads, sum_bytes, strips: vec![Strip { first: 0, rows: size.height }] }
    }

    /// Bytes of one row of a plane.
    pub(crate) fn row_bytes(&self) -> u64 {
        (self.quads as u64).saturating_mul(self.words as u64).saturating_mul(VECTOR_BYTES)
    }

    /// The bytes of a strip's plane, including one row above and one below.
    pub(crate) fn plane_bytes(&self, strip: Strip) -> u64 {
        self.row_bytes().saturating_mul(strip.rows as u64 + 2)
    }

    /// Bytes of the sums that belong to a plane.
    pub(crate) fn sums_bytes(&self, strip: Strip) -> u64 {
        self.plane_bytes(strip).saturating_mul(self.sum_bytes as u64)
    }

    /// The bytes of all grey values: one for each node of both colours of a row, rounded up to whole words.
    pub(crate) fn grey_bytes(&self) -> u64 {
        2 * (self.words * WORD_NODES) as u64 * self.size.height as u64
    }

    /// The bytes of the costs of all edges: a step and a truncation for each of four sides of the same nodes.
    pub(crate) fn edge_bytes(&self) -> u64 {
        8 * self.grey_bytes()
    }

    /// The most rows of a strip whose largest buffer fits.
    fn most_rows(&self, bytes: u64) -> usize {
        let rows = bytes / self.row_bytes().saturating_mul(self.sum_bytes.max(1) as u64).max(1);
        usize::try_from(rows.saturating_sub(2)).unwrap_or(usize::MAX)
    }

    fn cut(&mut self, rows: usize) {
        let height = self.size.height;
        self.strips = (0..height).step_by(rows).map(|first| Strip { first, rows: rows.min(height - first) }).collect();
    }

    /// The strip that contains row `y`.
    pub(crate) fn strip_of(&self, y: usize) -> usize {
        self.strips.iter().rposition(|strip| strip.first <= y).unwrap_or(0)
    }

    /// The position of the byte of a node and label in a plane of a strip. The node's colour selects the plane.
    pub(crate) fn byte(&self, strip: Strip, node: Node, label: usize) -> usize {
        let Node { x, y } = node;
        let node = x / 2;
        let vector = ((y - strip.first + 1) * self.quads + label / QUAD_LABELS) * self.words + node / WORD_NODES;
        VECTOR_BYTES as usize * vector + WORD_NODES * (label % QUAD_LABELS) + node % WORD_NODES
    }
}

/// Colour of a node.
pub(crate) fn colour(node: Node) -> usize {
    usize::from(!node.is_even())
}

/// The grids of a plan. Grids whose buffers would be too large are cut into strips. A strip begins at an even row of the
/// next finer grid's strip and, under [`Schedule::Sweep`], at the first row of a band.
///
/// # Errors
/// [`Error::Unsupported`] if even the smallest strip is too large.
pub(crate) fn grids(plan: &Plan, limits: &Limits) -> Result<Vec<Grid>, Error> {
    let mut grids: Vec<_> = (0..plan.grids()).map(|grid| Grid::new(plan, grid)).collect();
    let bytes = limits.binding_bytes.min(limits.buffer_bytes);
    let too_large = |grid: &Grid| grid.most_rows(bytes) < grid.size.height;
    let cut = 0..grids.iter().position(|grid| !too_large(grid)).unwrap_or(grids.len());
    if cut.is_empty() {
        return Ok(grids);
    }
    let rows = strip_rows(plan, &grids, cut.clone(), bytes);
    if rows == 0 {
        let what = format!("its buffers hold at most {bytes} bytes, too few for a strip of the image");
        let reason = format!("{what}: take fewer labels, a smaller image or fewer grids");
        return Err(Error::Unsupported { device: limits.device.clone(), reason });
    }
    cut.for_each(|grid| grids[grid].cut(rows >> grid));
    Ok(grids)
}

/// The number of rows of grid 0 in a strip, if the grids `cut` are cut.
fn strip_rows(plan: &Plan, grids: &[Grid], cut: Range<usize>, bytes: u64) -> usize {
    let sweep = plan.settings().schedule == Schedule::Sweep;
    let unit = if sweep { BAND_ROWS } else { 2 } << (cut.end - 1);
    let most = cut.map(|grid| grids[grid].most_rows(bytes).min(plan.image_size().height) << grid).min().unwrap_or(0);
    most / unit * unit
}
