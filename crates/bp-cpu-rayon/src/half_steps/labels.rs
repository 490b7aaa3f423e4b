//! The labels of a grid, as they are decided.

use bp_core::{Error, Plan, memory::Buffer};
use rayon::prelude::*;

use crate::{
    block::{Block, LANES},
    layout::Layout,
    shape::Shape,
};

/// Labels by checkerboard colour, `[row][block]`: a block with their low bytes and one with their high bytes.
pub(crate) struct Labels {
    by_colour: [Buffer<Block>; 2],
}

/// The blocks of a row of one colour.
pub(crate) fn row(shape: &Shape) -> usize {
    2 * shape.blocks
}

/// The bytes that [`Labels`] will hold.
pub(crate) fn bytes(shape: &Shape) -> u64 {
    (2 * row(shape) * shape.size.height * size_of::<Block>()) as u64
}

impl Labels {
    /// Allocates room for the labels of grid 0.
    pub(crate) fn new(plan: &Plan) -> Result<Self, Error> {
        let shape = Shape::new(plan, 0);
        let of_colour = || Buffer::filled("labels", row(&shape) * shape.size.height, Block::ZERO);
        Ok(Self { by_colour: [of_colour()?, of_colour()?] })
    }

    /// Allocates nothing.
    pub(crate) fn none() -> Self {
        Self { by_colour: [Buffer::default(), Buffer::default()] }
    }

    /// The rows by colour, which threads can split by [`row`].
    pub(crate) fn rows_mut(&mut self) -> [&mut [Block]; 2] {
        self.by_colour.each_mut().map(|labels| &mut **labels)
    }

    /// Writes them in order, `[height][width]`.
    pub(crate) fn hand_out(&self, layout: &Layout, labels: &mut [u16]) {
        labels.par_chunks_exact_mut(layout.size.width).enumerate().for_each(|(y, out)| {
            for plane in 0..2 {
                let blocks = &self.by_colour[(plane + y) % 2][row(layout) * y..][..row(layout)];
                let out = out.get_mut(plane..).unwrap_or_default().chunks_mut(2 * LANES);
                for (pair, out) in blocks.as_chunks::<2>().0.iter().zip(out) {
                    let labels = pair[0].0.iter().zip(pair[1].0).map(|(&low, high)| u16::from_le_bytes([low, high]));
                    out.iter_mut().step_by(2).zip(labels).for_each(|(out, label)| *out = label);
                }
            }
        });
    }

    /// The bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        self.by_colour.iter().map(Buffer::bytes).sum()
    }
}
