//! Labels under the schedule `sweep`, decided one after another.

use bp_core::{BAND_ROWS, Plan, Side, Smoothness};

use crate::{
    costs::Costs,
    greys::Greys,
    messages::Messages,
    select_labels::smallest_least,
    sweep::{EVEN, ODD, row_nodes},
};

/// Writes the label of every node in the order of [`bp_core::Schedule::Sweep`]. `sums` is room for one node's labels.
pub(crate) fn decode(
    plan: &Plan,
    costs: &Costs,
    greys: &Greys,
    messages: &Messages,
    labels: &mut [u16],
    sums: &mut [u8],
) {
    let size = plan.image_size();
    for (y, parity) in (0..size.height).flat_map(|y| [(y, EVEN), (y, ODD)]) {
        for x in row_nodes(size.width, y, parity) {
            let node = y * size.width + x;
            sums.copy_from_slice(costs.of(node));
            for side in Side::ALL {
                let has_label = match side {
                    Side::Up => !y.is_multiple_of(BAND_ROWS),
                    Side::Left | Side::Right => parity == ODD,
                    Side::Down => false,
                };
                if !has_label {
                    add_message(messages.received(node, side), sums);
                } else if let Some((x, y)) = plan.neighbour(0, (x, y), side) {
                    let other = y * size.width + x;
                    add_smoothness(greys.smoothness(node, other), labels[other], sums);
                }
            }
            labels[node] = smallest_least(sums);
        }
    }
}

fn add_message(message: &[u8], sums: &mut [u8]) {
    sums.iter_mut().zip(message).for_each(|(sum, &message)| *sum = sum.saturating_add(message));
}

/// Adds the smoothness cost of every label beside `label`; it is at most K, which fits.
fn add_smoothness(smoothness: Smoothness, label: u16, sums: &mut [u8]) {
    for (d, sum) in (0..).zip(sums) {
        *sum = sum.saturating_add(smoothness.of(d, label) as u8);
    }
}
