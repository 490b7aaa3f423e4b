//! The shape of a grid and the edges between its nodes.

use std::ops::Deref;

use bp_core::{Error, Node, Plan, Side, memory};

use crate::{
    greys::{self, Around, Greys},
    shape::{Shape, WIDEST},
};

/// The bytes that the [`Layout`] of a grid will hold.
pub(crate) fn bytes(plan: &Plan, grid: usize) -> u64 {
    let shape = Shape::new(plan, grid);
    (4 * (shape.lanes() + 2 * WIDEST) + 2 * shape.lanes() + shape.size.height) as u64 + greys::bytes(plan, grid)
}

/// A shape and the edges between its nodes: which of them exist and, once a pair is loaded, their levels.
#[derive(Debug)]
pub(crate) struct Layout {
    shape: Shape,
    /// Two masks for each plane. The first is 255 where a node exchanges messages with its neighbour in the same pair
    /// of columns, otherwise 0. The second does the same for the neighbour in the next pair. As many zeros as the widest vector has lanes precede
    /// and follow each mask.
    masks: [[Vec<u8>; 2]; 2],
    /// A mask for nodes without neighbours (all 0), and one for nodes that all have one (all 255).
    none_and_all: [Vec<u8>; 2],
    /// For each row, whether it exchanges messages with the row above.
    joined_above: Vec<bool>,
    pub(crate) greys: Greys,
}

impl Deref for Layout {
    type Target = Shape;

    fn deref(&self) -> &Shape {
        &self.shape
    }
}

impl Layout {
    /// The layout of a grid of `plan`.
    pub(crate) fn new(plan: &Plan, grid: usize) -> Result<Self, Error> {
        let shape = Shape::new(plan, grid);
        let mask = |plane: usize, side: Side| -> Result<Vec<u8>, Error> {
            let mut mask = memory::filled("masks", shape.lanes() + 2 * WIDEST, 0)?;
            for lane in 0..shape.nodes(plane) {
                let joined = plan.neighbour(grid, Node { x: 2 * lane + plane, y: 0 }, side).is_some();
                mask[WIDEST + lane] = if joined { u8::MAX } else { 0 };
            }
            Ok(mask)
        };
        let mut joined_above = memory::filled("masks", shape.size.height, false)?;
        for (y, joined) in joined_above.iter_mut().enumerate() {
            *joined = plan.neighbour(grid, Node { x: 0, y }, Side::Up).is_some();
        }
        Ok(Self {
            shape,
            masks: [[mask(0, Side::Right)?, mask(0, Side::Left)?], [mask(1, Side::Left)?, mask(1, Side::Right)?]],
            none_and_all: [
                memory::filled("masks", shape.lanes(), 0)?,
                memory::filled("masks", shape.lanes(), u8::MAX)?,
            ],
            joined_above,
            greys: Greys::new(plan, grid)?,
        })
    }

    /// The bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        let masks = self.masks.iter().flatten().chain(&self.none_and_all);
        masks.map(memory::bytes).sum::<u64>() + memory::bytes(&self.joined_above) + self.greys.bytes()
    }

    /// The masks of `plane` for neighbours in the same and in the next pair of columns, `[lane]`.
    pub(crate) fn masks(&self, plane: usize) -> [&[u8]; 2] {
        self.padded_masks(plane).map(|mask| &mask[WIDEST..WIDEST + self.lanes()])
    }

    /// As [`Layout::masks`], with the zeros before and after.
    pub(crate) fn padded_masks(&self, plane: usize) -> [&[u8]; 2] {
        self.masks[plane].each_ref().map(Vec::as_slice)
    }

    /// A mask for nodes without neighbours, and one for nodes that all have a neighbour, `[lane]`.
    pub(crate) fn none_and_all(&self) -> [&[u8]; 2] {
        self.none_and_all.each_ref().map(Vec::as_slice)
    }

    /// The grey values around the nodes of `plane` in row `y`; `None` if all edges have the same cost.
    pub(crate) fn around(&self, plane: usize, y: usize) -> Option<Around<'_>> {
        self.greys.around(plane, y)
    }

    /// Whether row `y` exchanges messages with the row above. The row after the last one does not.
    pub(crate) fn joined_above(&self, y: usize) -> bool {
        self.joined_above.get(y).copied().unwrap_or(false)
    }
}
