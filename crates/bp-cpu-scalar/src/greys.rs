//! The grey values of one grid. They determine the levels of edges; see [`bp_core::EdgeLevels`].

use bp_core::{Error, Image, Model, Plan, Size, Smoothness, memory};

/// Grey values `[node]`; empty if all edges have the same cost.
pub(crate) struct Greys {
    model: Model,
    size: Size,
    values: Vec<u8>,
}

impl Greys {
    /// Allocates room for the grey values of `grid`.
    pub(crate) fn new(plan: &Plan, grid: usize) -> Result<Self, Error> {
        let values = memory::filled("grey values", plan.grey_bytes(grid) as usize, 0)?;
        Ok(Self { model: *plan.model(), size: plan.size(grid), values })
    }

    /// Loads the grey values of an image from column `margin` on.
    pub(crate) fn load(&mut self, image: &Image, margin: usize) {
        for (node, value) in self.values.iter_mut().enumerate() {
            *value = image.grey(margin + node % self.size.width, node / self.size.width);
        }
    }

    /// Computes the grey values of a coarser grid: a node has the mean of its children, at most four.
    pub(crate) fn coarsen(&mut self, fine: &Self) {
        for (node, value) in self.values.iter_mut().enumerate() {
            let (x, y) = (2 * (node % self.size.width), 2 * (node / self.size.width));
            let (mut sum, mut count) = (0, 0);
            for child_y in y..(y + 2).min(fine.size.height) {
                for child_x in x..(x + 2).min(fine.size.width) {
                    sum += u16::from(fine.values[child_y * fine.size.width + child_x]);
                    count += 1;
                }
            }
            *value = Model::coarse_grey(sum, count);
        }
    }

    /// The smoothness cost of the edge between two nodes.
    pub(crate) fn smoothness(&self, a: usize, b: usize) -> Smoothness {
        match (self.values.get(a), self.values.get(b)) {
            (Some(&a), Some(&b)) => self.model.smoothness_between(a, b),
            _ => self.model.smoothness(),
        }
    }

    /// The bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        memory::bytes(&self.values)
    }
}
