//! The work of the nodes of a plane in a row in one half-step.

use bp_core::Plan;
use fearless_simd::Level;

use super::{
    edges, labels,
    refine::{Coarser, refine},
    select_labels::select_labels,
    update_messages::{Nodes, update_messages},
};
use crate::{block::Block, layout::Layout, shape::PlaneRow};

/// What the last step of a grid does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Last {
    /// It keeps the messages that every node received last, for the next finer grid.
    Keeps,
    /// It also decides labels.
    Decides,
    /// It decides labels, and overwrites the messages that its senders received. That saves the second set's way to memory.
    DecidesOnly,
}

/// Everything that updating the messages of a grid needs besides the messages.
pub(crate) struct Pass<'a> {
    pub(crate) level: Level,
    pub(crate) plan: &'a Plan,
    pub(crate) layout: &'a Layout,
    pub(crate) costs: &'a [Block],
    pub(crate) coarser: Option<Coarser<'a>>,
    /// Whether the grid starts with the messages that it already holds, instead of those of the coarser grid.
    pub(crate) keeps_messages: bool,
    pub(crate) last: Last,
}

impl Pass<'_> {
    /// Writes the first messages of the nodes of a plane in a row. `rows` start with that row.
    pub(crate) fn refine(&self, at: PlaneRow, rows: &mut [Block]) {
        let mut slots = edges::slots(self.layout, rows, at.plane);
        refine(self.level, self.plan, self.layout, self.coarser, at, &mut slots.values);
    }

    /// Sends the messages of the nodes of a plane in a row. `rows` start with that row.
    pub(crate) fn send(&self, at: PlaneRow, rows: &mut [Block]) {
        let mut slots = edges::slots(self.layout, rows, at.plane);
        self.drop_missing(at.y, &mut slots.values);
        update_messages(self.level, &self.nodes(at), slots);
    }

    /// Decides the labels of the nodes of a plane in a row, if there is room for them. `rows` and `labels` start with that row.
    pub(crate) fn decide(&self, at: PlaneRow, rows: &[Block], labels: &mut [Block]) {
        if let Some(labels) = labels.get_mut(..labels::row(self.layout)) {
            let received = edges::received(self.layout, rows, at);
            select_labels(self.level, &self.nodes(at), received, labels);
        }
    }

    fn nodes(&self, PlaneRow { plane, y }: PlaneRow) -> Nodes<'_> {
        let (layout, model) = (self.layout, self.plan.model());
        Nodes {
            costs: &self.costs[y * layout.row() + plane * layout.plane()..][..layout.plane()],
            masks: layout.masks(plane),
            shape: layout,
            edges: model.edges(),
            around: layout.around(plane, y),
        }
    }

    /// Sets the slots of missing neighbours above and below to zeros. Masks handle those at the sides.
    fn drop_missing(&self, y: usize, [_, _, up, down]: &mut [&mut [Block]; 4]) {
        for (row, slot) in [(y, up), (y + 1, down)] {
            if !self.layout.joined_above(row) {
                slot.fill(Block::ZERO);
            }
        }
    }
}
