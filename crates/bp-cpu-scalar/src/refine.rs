//! First messages of a grid.

use bp_core::{MessageStart, Plan, Schedule, Side};

use crate::messages::Messages;

/// Starts every node of `grid` with messages of its parent on the next coarser grid. The parent of (x, y) is
/// (x div 2, y div 2).
pub(crate) fn refine(plan: &Plan, grid: usize, coarse: &Messages, fine: &mut Messages) {
    let size = plan.size(grid);
    fine.clear(size.pixels());
    for node in 0..size.pixels() {
        let (x, y) = (node % size.width, node / size.width);
        for side in Side::ALL {
            let Some(sender) = plan.neighbour(grid, (x, y), side) else { continue };
            if let Some(receiver) = coarse_receiver(plan, grid, (x, y), sender, side) {
                fine.received_mut(node, side).copy_from_slice(coarse.received(receiver, side));
            }
        }
    }
}

/// The coarse node whose message from `side` the fine node at (x, y) starts with: its own parent, or the node that its
/// sender's parent sends to; `None` where it starts with zeros.
fn coarse_receiver(
    plan: &Plan,
    grid: usize,
    (x, y): (usize, usize),
    sender: (usize, usize),
    side: Side,
) -> Option<usize> {
    let (x, y) = match plan.settings().message_start {
        MessageStart::Receiver if plan.settings().schedule == Schedule::Sweep => {
            sweep_receiver(plan, grid, (x, y), side)?
        }
        MessageStart::Receiver => (x / 2, y / 2),
        MessageStart::Sender => plan.neighbour(grid + 1, (sender.0 / 2, sender.1 / 2), side.opposite())?,
    };
    Some(y * plan.size(grid + 1).width + x)
}

/// The same under the schedule `sweep`, whose edges hold the message up or the one towards their even end: an odd
/// parent received nothing from that side, but its neighbour there, which is even, did.
fn sweep_receiver(plan: &Plan, grid: usize, (x, y): (usize, usize), side: Side) -> Option<(usize, usize)> {
    let parent = (x / 2, y / 2);
    let is_even = |(x, y): (usize, usize)| (x + y).is_multiple_of(2);
    match side {
        Side::Up => None,
        Side::Down => Some(parent),
        Side::Left | Side::Right if !is_even((x, y)) => None,
        Side::Left | Side::Right if is_even(parent) => Some(parent),
        Side::Left | Side::Right => plan.neighbour(grid + 1, parent, side),
    }
}
