//! Label sets; see [`bp_core::Settings::label_sets`].
//!
//! A label that a node's set lacks has the data cost 255. No sum of a label of the set reaches that, so no message and no
//! label is made from it.

use std::ops::Range;

use bp_core::{LabelSet, Patch, Plan, Side, Smoothness};

use crate::{costs::Costs, messages::Messages};

/// Gives the nodes of rows that are passed together the costs of their label sets. `coarser` are the labels of the next
/// coarser grid, `scratch` has room for one node's labels.
pub(crate) fn restrict(
    plan: &Plan,
    grid: usize,
    rows: Range<usize>,
    coarser: &[u16],
    costs: &mut Costs,
    scratch: &mut [u64],
) {
    let size = plan.size(grid);
    for patch in Patch::all(size.width, rows) {
        let set = set(plan, grid, &patch, coarser);
        patch.nodes().for_each(|node| costs.restrict(size.index(node), &set, scratch));
    }
}

/// Extends the messages that these rows received from `sides` to all labels, from those of their label sets.
pub(crate) fn extend(
    plan: &Plan,
    grid: usize,
    rows: [Range<usize>; 2],
    coarser: &[u16],
    sides: &[Side],
    messages: &mut Messages,
) {
    let (size, [passed, extended]) = (plan.size(grid), rows);
    for patch in Patch::all(size.width, passed) {
        let set = set(plan, grid, &patch, coarser);
        for node in patch.nodes().filter(|node| extended.contains(&node.y)) {
            for &side in sides.iter().filter(|&&side| plan.neighbour(grid, node, side).is_some()) {
                if side == Side::Up || side == Side::Down || node.is_even() {
                    extend_message(plan.model().smoothness(), &set, messages.received_mut(size.index(node), side));
                }
            }
        }
    }
}

/// The set of a patch, given the labels of the next coarser grid, `[height][width]`.
fn set(plan: &Plan, grid: usize, patch: &Patch, coarser: &[u16]) -> LabelSet {
    LabelSet::of(plan, grid, patch, |y| &coarser[y * plan.size(grid + 1).width..])
}

/// The value at d becomes the least `min(M(e) + s |d - e|, K)` over e in the set, by two passes.
fn extend_message(smoothness: Smoothness, set: &LabelSet, message: &mut [u8]) {
    let (step, truncation) = (smoothness.step(), smoothness.truncation);
    for (label, value) in message.iter_mut().enumerate() {
        *value = if set.contains(label) { *value } else { u8::MAX };
    }
    let mut envelope = u8::MAX;
    let mut lower = |value: &mut u8| {
        envelope = envelope.saturating_add(step).min(*value);
        *value = envelope;
    };
    message.iter_mut().for_each(&mut lower);
    message.iter_mut().rev().for_each(lower);
    message.iter_mut().for_each(|value| *value = (*value).min(truncation));
}
