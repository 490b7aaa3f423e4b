//! One pass over a row: what the nodes of a plane do in a step, whichever schedule runs.

use bp_core::{Plan, Side};
use fearless_simd::Level;

use crate::{
    edges,
    greys::Around,
    layout::Layout,
    refine::{Coarser, refine},
    update_messages::{Nodes, Sends, update_messages},
};

/// Which way a pass over the rows goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Way {
    Down,
    Up,
}

/// What updating the messages of a grid needs besides those.
pub(crate) struct Pass<'a> {
    pub(crate) level: Level,
    pub(crate) plan: &'a Plan,
    pub(crate) layout: &'a Layout,
    /// Row that `costs` start with.
    pub(crate) first: usize,
    pub(crate) costs: &'a [u8],
    pub(crate) coarser: Option<Coarser<'a>>,
    /// Whether it starts with the messages that it holds in place of the coarser grid's.
    pub(crate) keeps_messages: bool,
}

impl Pass<'_> {
    /// Gives nodes of a plane in row `y`, with which `rows` start, their first messages.
    pub(crate) fn refine(&self, (plane, y): (usize, usize), sides: &[Side], rows: &mut [u8]) {
        let mut slots = edges::slots(self.layout, rows, plane);
        refine(self.level, self.plan, self.layout, self.coarser, (plane, y), sides, &mut slots);
    }

    /// Lets nodes of a plane in row `y`, with which `rows` start, send in a pass that goes some way.
    pub(crate) fn send(&self, way: Way, (plane, y): (usize, usize), sends: Sends, rows: &mut [u8]) {
        let mut slots = edges::slots(self.layout, rows, plane);
        self.drop_missing(y, &mut slots);
        let mut nodes = self.nodes(plane, y);
        if way == Way::Up {
            slots.swap(2, 3);
            nodes.around = nodes.around.map(Around::upwards);
        }
        update_messages(self.level, sends, &nodes, slots);
    }

    fn nodes(&self, plane: usize, y: usize) -> Nodes<'_> {
        let (layout, model) = (self.layout, self.plan.model());
        Nodes {
            costs: &self.costs[(y - self.first) * layout.row() + plane * layout.plane()..][..layout.plane()],
            masks: layout.masks(plane),
            nodes: layout.nodes(plane),
            lanes: layout.lanes,
            smoothness: model.smoothness(),
            around: layout.around(plane, y),
        }
    }

    /// Zeros in the slots of neighbours above and below that are not there. Of those at the sides, masks take care.
    fn drop_missing(&self, y: usize, [_, _, up, down]: &mut [&mut [u8]; 4]) {
        for (row, slot) in [(y, up), (y + 1, down)] {
            if !self.layout.joined_above(row) {
                slot.fill(0);
            }
        }
    }
}
