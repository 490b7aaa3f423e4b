//! What message passing on one grid needs besides the messages.

use bp_core::{Node, Plan, Side, Size};

use crate::{
    costs::Costs,
    greys::Greys,
    messages::{Messages, add},
};

/// A grid of a plan, with its data costs and grey values.
#[derive(Clone, Copy)]
pub(crate) struct Grid<'a> {
    pub(crate) plan: &'a Plan,
    pub(crate) index: usize,
    pub(crate) costs: &'a Costs,
    pub(crate) greys: &'a Greys,
}

impl Grid<'_> {
    /// The size of the grid.
    pub(crate) fn size(&self) -> Size {
        self.plan.size(self.index)
    }

    /// The neighbour that a node exchanges messages with.
    pub(crate) fn neighbour(&self, node: Node, side: Side) -> Option<Node> {
        self.plan.neighbour(self.index, node, side)
    }

    /// Computes the message from `node` to its neighbour `receiver` on the side `to`, into `h`.
    ///
    /// ```text
    /// h(a)       = data cost of a + the messages that the node received from all sides but `to`
    /// message(d) = min over a of (h(a) + min(slope |a - d|, K)), less its minimum over d, which is that of h
    /// ```
    ///
    /// The minimum over a is the lower envelope of L cones. One pass up and one pass down the labels compute it
    /// (Felzenszwalb and Huttenlocher 2006).
    pub(crate) fn message(&self, messages: &Messages, node: Node, to: Side, receiver: Node, h: &mut [u8]) {
        let [node, receiver] = [node, receiver].map(|node| self.size().index(node));
        h.copy_from_slice(self.costs.of(node));
        for from in Side::ALL.into_iter().filter(|&from| from != to) {
            add(messages.received(node, from), h);
        }
        let smoothness = self.greys.smoothness(node, receiver);
        let (step, truncation) = (smoothness.step(), smoothness.truncation);
        let least = h.iter().copied().min().unwrap_or(0);
        let mut envelope = u8::MAX;
        for h in h.iter_mut() {
            envelope = envelope.saturating_add(step).min(*h);
            *h = envelope;
        }
        for h in h.iter_mut().rev() {
            envelope = envelope.saturating_add(step).min(*h);
            *h = (envelope - least).min(truncation);
        }
    }
}
