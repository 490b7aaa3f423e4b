//! Label selection.

use bp_core::Schedule;

use crate::{beliefs::lowest_beliefs, grid::Grid, messages::Messages, seams::Seams};

/// Writes the label of every node of grid 0. `sums` has room for one node's labels.
pub(crate) fn select_labels(grid: &Grid<'_>, messages: &Messages, seams: &Seams, labels: &mut [u16], sums: &mut [u8]) {
    match grid.plan.settings().schedule {
        Schedule::Sync | Schedule::Checkerboard | Schedule::Outward { .. } => {
            lowest_beliefs(grid.costs, messages, labels, sums)
        }
        Schedule::Sweep => seams.decode(grid, messages, labels, sums),
    }
}
