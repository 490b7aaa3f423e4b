//! Labels under the schedule `sweep`, decided one after another.

use bp_core::{BAND_ROWS, Side, Smoothness};

use crate::{
    beliefs::smallest_least,
    grid::Grid,
    messages::{Messages, add},
    row::{Parity, row_nodes},
};

/// Writes the label of every node in the order of [`bp_core::Schedule::Sweep`]. `sums` has room for one node's labels.
///
/// A neighbour that already has a label adds its smoothness cost; any other adds its message.
pub(crate) fn decode(grid: &Grid<'_>, messages: &Messages, labels: &mut [u16], sums: &mut [u8]) {
    let size = grid.size;
    for (y, parity) in (0..size.height).flat_map(|y| [(y, Parity::Even), (y, Parity::Odd)]) {
        for node in row_nodes(size, y, parity) {
            let index = size.index(node);
            sums.copy_from_slice(grid.costs.of(index));
            for side in Side::ALL {
                let has_label = match side {
                    Side::Up => !y.is_multiple_of(BAND_ROWS),
                    Side::Left | Side::Right => parity == Parity::Odd,
                    Side::Down => false,
                };
                if !has_label {
                    add(messages.received(index, side), sums);
                } else if let Some(other) = grid.neighbour(node, side) {
                    let other = size.index(other);
                    add_smoothness(grid.greys.smoothness(index, other), labels[other], sums);
                }
            }
            labels[index] = smallest_least(sums);
        }
    }
}

/// Adds the smoothness cost between every label and `label`. It is at most K, which fits 8 bits.
fn add_smoothness(smoothness: Smoothness, label: u16, sums: &mut [u8]) {
    for (d, sum) in (0..).zip(sums) {
        *sum = sum.saturating_add(smoothness.of(d, label) as u8);
    }
}
