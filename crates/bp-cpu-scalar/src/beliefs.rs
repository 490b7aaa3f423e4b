//! Selects the labels with the lowest belief.

use bp_core::Side;

use crate::{
    costs::Costs,
    messages::{Messages, add},
};

/// Writes the label with the lowest belief of every node. `belief` has room for one node's labels.
///
/// ```text
/// belief(d) = data cost of d + the messages received from all four sides
/// ```
pub(crate) fn lowest_beliefs(costs: &Costs, messages: &Messages, labels: &mut [u16], belief: &mut [u8]) {
    for (node, label) in labels.iter_mut().enumerate() {
        belief.copy_from_slice(costs.of(node));
        Side::ALL.into_iter().for_each(|side| add(messages.received(node, side), belief));
        *label = smallest_least(belief);
    }
}

/// The label with the lowest sum; the smallest label wins a tie.
pub(crate) fn smallest_least(sums: &[u8]) -> u16 {
    let least = sums.iter().copied().min();
    sums.iter().position(|&sum| Some(sum) == least).unwrap_or(0) as u16
}
