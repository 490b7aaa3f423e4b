//! Labels under the schedule `sweep`, decided one after another.

use std::ops::Range;

use bp_core::{Node, Side, Smoothness};

use crate::{
    beliefs::smallest_least,
    grid::Grid,
    messages::{Messages, add},
    row::{Parity, row_nodes},
};

/// Writes the labels of these rows, given those of the row above, if there are any.
///
/// A neighbour that already has a label adds its smoothness cost; any other adds its message.
pub(crate) fn decode_rows(
    grid: &Grid<'_>,
    messages: &Messages,
    rows: Range<usize>,
    above: Option<&[u16]>,
    labels: &mut [u16],
    sums: &mut [u8],
) {
    let (size, first) = (grid.size, rows.start);
    let place = |Node { x, y }| (y - first) * size.width + x;
    for (y, parity) in rows.flat_map(|y| [(y, Parity::Even), (y, Parity::Odd)]) {
        for node in row_nodes(size, y, parity) {
            let index = size.index(node);
            sums.copy_from_slice(grid.costs.of(index));
            for side in Side::ALL {
                let decided = match side {
                    Side::Up if y > first => grid.neighbour(node, side).map(|other| labels[place(other)]),
                    Side::Up => grid.neighbour(node, side).and_then(|other| Some(above?[other.x])),
                    Side::Left | Side::Right if parity == Parity::Odd => {
                        grid.neighbour(node, side).map(|other| labels[place(other)])
                    }
                    _ => {
                        add(messages.received(index, side), sums);
                        None
                    }
                };
                if let (Some(label), Some(other)) = (decided, grid.neighbour(node, side)) {
                    add_smoothness(grid.greys.smoothness(index, size.index(other)), label, sums);
                }
            }
            labels[place(node)] = smallest_least(sums);
        }
    }
}

/// Adds the smoothness cost of every label beside `label`. It is at most K, which fits 8 bits.
fn add_smoothness(smoothness: Smoothness, label: u16, sums: &mut [u8]) {
    for (d, sum) in (0..).zip(sums) {
        *sum = sum.saturating_add(smoothness.of(d, label) as u8);
    }
}
