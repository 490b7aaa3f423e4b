//! Labels under the schedule `sweep`, decided one after another.

use bp_core::{Plan, Side};

use crate::{
    costs::Costs,
    messages::Messages,
    select_labels::smallest_least,
    sweep::{EVEN, ODD, bands, row_nodes},
};

/// Writes the label of every node in the order of [`bp_core::Schedule::Sweep`]. `sums` is room for one node's labels.
pub(crate) fn decode(plan: &Plan, costs: &Costs, messages: &Messages, labels: &mut [u16], sums: &mut [u8]) {
    let size = plan.image_size();
    for band_parity in [ODD, EVEN] {
        for rows in bands(size.height, band_parity) {
            for (y, parity) in rows.clone().flat_map(|y| [(y, EVEN), (y, ODD)]) {
                let decided = Decided { above: band_parity == EVEN || y > rows.start, beside: parity == ODD };
                for x in row_nodes(size.width, y, parity) {
                    sums.copy_from_slice(costs.of(y * size.width + x));
                    add_neighbours(plan, (x, y), decided, messages, labels, sums);
                    labels[y * size.width + x] = smallest_least(sums);
                }
            }
        }
    }
}

/// Which neighbours have their label when a node is decided. Those below count as undecided always.
#[derive(Clone, Copy)]
struct Decided {
    above: bool,
    beside: bool,
}

/// Adds to the sums of (x, y), from each side, the smoothness cost to the neighbour's label where it has one, else the
/// message received.
fn add_neighbours(
    plan: &Plan,
    (x, y): (usize, usize),
    decided: Decided,
    messages: &Messages,
    labels: &[u16],
    sums: &mut [u8],
) {
    let width = plan.image_size().width;
    for side in Side::ALL {
        let has_label = match side {
            Side::Up => decided.above,
            Side::Left | Side::Right => decided.beside,
            Side::Down => false,
        };
        if !has_label {
            let message = messages.received(y * width + x, side);
            sums.iter_mut().zip(message).for_each(|(sum, &message)| *sum = sum.saturating_add(message));
        } else if let Some((x, y)) = plan.neighbour(0, (x, y), side) {
            add_smoothness(plan, labels[y * width + x], sums);
        }
    }
}

/// Adds the smoothness cost of every label beside `label`; it is at most K, which fits.
fn add_smoothness(plan: &Plan, label: u16, sums: &mut [u8]) {
    for (d, sum) in (0..).zip(sums) {
        *sum = sum.saturating_add(plan.model().smoothness(d, label) as u8);
    }
}
