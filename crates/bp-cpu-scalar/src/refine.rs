//! First messages of a grid.

use std::ops::Range;

use bp_core::{MAX_LABELS, MessageStart, Node, Plan, Schedule, Side};

use crate::messages::Messages;

/// Gives every node in these rows of `grid` its first messages, made from those of the next coarser grid.
pub(crate) fn refine(plan: &Plan, grid: usize, rows: Range<usize>, coarse: &Messages, fine: &mut Messages) {
    let size = plan.size(grid);
    fine.clear(rows.start * size.width..rows.end * size.width);
    for node in rows.flat_map(|y| (0..size.width).map(move |x| Node { x, y })) {
        for side in Side::ALL.into_iter().filter(|&side| plan.neighbour(grid, node, side).is_some()) {
            let message = fine.received_mut(size.index(node), side);
            if plan.settings().schedule == Schedule::Sweep {
                interpolate(plan, grid, node, side, coarse, message);
            } else if let Some(receiver) = coarse_receiver(plan, grid, node, side) {
                message.copy_from_slice(coarse.received(plan.size(grid + 1).index(receiver), side));
            }
        }
    }
}

/// The coarse node whose message from `side` a fine node starts with: its own parent, or the node that its sender's
/// parent sends to. `None` if the fine node starts with zeros.
fn coarse_receiver(plan: &Plan, grid: usize, node: Node, side: Side) -> Option<Node> {
    match plan.settings().message_start {
        MessageStart::Receiver => Some(node.parent()),
        MessageStart::Sender => {
            let sender = plan.neighbour(grid, node, side)?;
            plan.neighbour(grid + 1, sender.parent(), side.opposite())
        }
    }
}

/// Writes a first message of [`bp_core::Schedule::Sweep`], interpolated between the four nearest coarse nodes.
fn interpolate(plan: &Plan, grid: usize, node: Node, side: Side, coarse: &Messages, message: &mut [u8]) {
    let starts = side == Side::Down || (side != Side::Up && node.is_even());
    let parent = node.parent();
    let (other_x, other_y) = (beside(parent.x, node.x), beside(parent.y, node.y));
    let received = |x: Option<usize>, y: Option<usize>| received(plan, grid + 1, Node { x: x?, y: y? }, side, coarse);
    let Some(near) = received(Some(parent.x), Some(parent.y)).filter(|_| starts) else { return };
    let above_or_below = received(Some(parent.x), other_y).unwrap_or(near);
    message.copy_from_slice(near);
    approach(message, above_or_below);
    if side == Side::Down {
        let aside = received(other_x, Some(parent.y));
        let diagonal = received(other_x, other_y).or(aside);
        for (d, message) in message.iter_mut().enumerate() {
            let aside = aside.zip(diagonal).map_or(*message, |(aside, diagonal)| nearer(aside[d], diagonal[d]));
            *message = nearer(*message, aside);
        }
    }
}

/// The message that a coarse node received from `side`. An edge holds only the message up or the message towards its even
/// end: an odd node received nothing from that side, but its neighbour there, which is even, did; without such a neighbour,
/// the message is zeros. `None` if there is no such node, or its row receives nothing from that side.
fn received<'a>(plan: &Plan, grid: usize, node: Node, side: Side, coarse: &'a Messages) -> Option<&'a [u8]> {
    let size = plan.size(grid);
    if node.x >= size.width || node.y >= size.height {
        return None;
    }
    let neighbour = plan.neighbour(grid, node, side);
    match side {
        Side::Left | Side::Right if !node.is_even() => Some(
            neighbour.map_or_else(|| &ZEROS[..plan.model().labels()], |node| coarse.received(size.index(node), side)),
        ),
        Side::Left | Side::Right => Some(coarse.received(size.index(node), side)),
        Side::Up | Side::Down => neighbour.map(|_| coarse.received(size.index(node), side)),
    }
}

/// A message of zeros.
static ZEROS: [u8; MAX_LABELS] = [0; MAX_LABELS];

/// Moves `near` a quarter of the way to `far`.
fn approach(near: &mut [u8], far: &[u8]) {
    near.iter_mut().zip(far).for_each(|(near, &far)| *near = nearer(*near, far));
}

/// The coarse row or column beside a parent's, on the side where its child lies.
fn beside(parent: usize, child: usize) -> Option<usize> {
    if child.is_multiple_of(2) { parent.checked_sub(1) } else { Some(parent + 1) }
}

/// Three quarters of `near` and one of `far`, as two means that are rounded up.
fn nearer(near: u8, far: u8) -> u8 {
    let mean = |a: u8, b: u8| (u16::from(a) + u16::from(b)).div_ceil(2) as u8;
    mean(mean(near, far), near)
}
