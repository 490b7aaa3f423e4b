//! Labels of least belief.

use bp_core::{Plan, Schedule, Side};

use crate::{costs::Costs, decode::decode, greys::Greys, messages::Messages};

/// Writes the label of every node. `belief` is room for one node's labels.
pub(crate) fn select_labels(
    plan: &Plan,
    costs: &Costs,
    greys: &Greys,
    messages: &Messages,
    labels: &mut [u16],
    belief: &mut [u8],
) {
    match plan.settings().schedule {
        Schedule::Sync | Schedule::Checkerboard => least_beliefs(costs, messages, labels, belief),
        Schedule::Sweep => decode(plan, costs, greys, messages, labels, belief),
    }
}

/// The smallest label of least belief of every node.
fn least_beliefs(costs: &Costs, messages: &Messages, labels: &mut [u16], belief: &mut [u8]) {
    for (node, label) in labels.iter_mut().enumerate() {
        belief.copy_from_slice(costs.of(node));
        for side in Side::ALL {
            for (belief, &message) in belief.iter_mut().zip(messages.received(node, side)) {
                *belief = belief.saturating_add(message);
            }
        }
        *label = smallest_least(belief);
    }
}

/// The label of the least sum, the smallest on ties.
pub(crate) fn smallest_least(sums: &[u8]) -> u16 {
    let least = sums.iter().copied().min();
    sums.iter().position(|&sum| Some(sum) == least).unwrap_or(0) as u16
}
