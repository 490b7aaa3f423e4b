//! Everything that message passing on one grid needs besides the messages.

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
    pub(crate) size: Size,
    pub(crate) costs: &'a Costs,
    pub(crate) greys: &'a Greys,
}

impl Grid<'_> {
    /// The neighbour that a node exchanges messages with.
    pub(crate) fn neighbour(&self, node: Node, side: Side) -> Option<Node> {
        self.plan.neighbour(self.index, node, side)
    }

    /// Sets `h` to the data costs of `node` plus the messages that it received from all sides except `to`.
    #[inline(always)]
    pub(crate) fn gather(&self, messages: &Messages, node: Node, to: Side, h: &mut [u8]) {
        let node = self.size.index(node);
        h.copy_from_slice(self.costs.of(node));
        for from in Side::ALL.into_iter().filter(|&from| from != to) {
            add(messages.received(node, from), h);
        }
    }

    /// Turns `h` of `node` into its message to the neighbour `receiver`.
    ///
    /// ```text
    /// message(d) = min over a of (h(a) + min(slope |a - d|, K)), less its minimum over d, which equals that of h
    /// ```
    ///
    /// The minimum over a is the lower envelope of L cones. One pass up and one pass down the labels compute it
    /// (Felzenszwalb and Huttenlocher 2006).
    #[inline(always)]
    pub(crate) fn send(&self, node: Node, receiver: Node, h: &mut [u8], message: &mut [u8]) {
        let smoothness = self.greys.smoothness(self.size.index(node), self.size.index(receiver));
        let (step, truncation) = (smoothness.step(), smoothness.truncation);
        let least = h.iter().copied().min().unwrap_or(0);
        let mut envelope = u8::MAX;
        for h in h.iter_mut() {
            envelope = envelope.saturating_add(step).min(*h);
            *h = envelope;
        }
        for h in h.iter_mut().rev() {
            envelope = envelope.saturating_add(step).min(*h);
            *h = envelope;
        }
        for (message, &h) in message.iter_mut().zip(&*h) {
            *message = (h - least).min(truncation);
        }
    }
}
