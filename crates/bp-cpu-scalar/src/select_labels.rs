//! Labels of least belief.

use bp_core::Side;

use crate::{costs::Costs, messages::Messages};

/// Writes the smallest label of least belief of every node. `belief` is room for one node's labels.
pub(crate) fn select_labels(costs: &Costs, messages: &Messages, labels: &mut [u16], belief: &mut [u8]) {
    for (node, label) in labels.iter_mut().enumerate() {
        belief.copy_from_slice(costs.of(node));
        for side in Side::ALL {
            for (belief, &message) in belief.iter_mut().zip(messages.received(node, side)) {
                *belief = belief.saturating_add(message);
            }
        }
        let least = belief.iter().copied().min();
        *label = belief.iter().position(|&belief| Some(belief) == least).unwrap_or(0) as u16;
    }
}
