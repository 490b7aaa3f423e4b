//! First messages of a grid.

use bp_core::{MessageStart, Node, Plan, Schedule, Side};

use crate::messages::Messages;

/// Gives every node of `grid` its first messages: those of its parent on the next coarser grid.
pub(crate) fn refine(plan: &Plan, grid: usize, coarse: &Messages, fine: &mut Messages) {
    let size = plan.size(grid);
    fine.clear(size.pixels());
    for node in size.nodes() {
        for side in Side::ALL {
            if let Some(receiver) = coarse_receiver(plan, grid, node, side) {
                let message = coarse.received(plan.size(grid + 1).index(receiver), side);
                fine.received_mut(size.index(node), side).copy_from_slice(message);
            }
        }
    }
}

/// The coarse node whose message from `side` a fine node starts with: its own parent, or the node that its sender's
/// parent sends to. `None` if the fine node starts with zeros.
fn coarse_receiver(plan: &Plan, grid: usize, node: Node, side: Side) -> Option<Node> {
    let sender = plan.neighbour(grid, node, side)?;
    match plan.settings().message_start {
        MessageStart::Receiver if plan.settings().schedule == Schedule::Sweep => sweep_receiver(plan, grid, node, side),
        MessageStart::Receiver => Some(node.parent()),
        MessageStart::Sender => plan.neighbour(grid + 1, sender.parent(), side.opposite()),
    }
}

/// The coarse receiver under the schedule `sweep`, where an edge holds only the upward message or the message towards
/// its even end. An odd parent received nothing from that side, but its even neighbour there did.
fn sweep_receiver(plan: &Plan, grid: usize, node: Node, side: Side) -> Option<Node> {
    let parent = node.parent();
    match side {
        Side::Up => None,
        Side::Down => Some(parent),
        Side::Left | Side::Right if !node.is_even() => None,
        Side::Left | Side::Right if parent.is_even() => Some(parent),
        Side::Left | Side::Right => plan.neighbour(grid + 1, parent, side),
    }
}
