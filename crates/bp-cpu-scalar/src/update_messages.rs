//! Message passing.

use bp_core::{Node, Schedule, Side};

use crate::{grid::Grid, messages::Messages, sweep::sweep};

/// Runs one step of the plan's schedule on a grid. `h` has room for one message.
pub(crate) fn update_messages(grid: &Grid<'_>, step: u32, messages: &mut Messages, h: &mut [u8]) {
    match grid.plan.settings().schedule {
        Schedule::Sync | Schedule::Checkerboard => parallel_step(grid, step, messages, h),
        Schedule::Sweep => sweep(grid, messages, h),
        Schedule::Outward { start } => outward(grid, start, messages, h),
    }
}

/// Runs a loop in which nodes send one after another, the nearest to the start node first. The order within a row and that of
/// rows is enough: a node's neighbours nearer to the start have sent before it, and all others send after it.
fn outward(grid: &Grid<'_>, start: Node, messages: &mut Messages, h: &mut [u8]) {
    let size = grid.size;
    let from = |first: usize, end: usize| (0..=first).rev().chain(first + 1..end);
    for node in from(start.y, size.height).flat_map(|y| from(start.x, size.width).map(move |x| Node { x, y })) {
        for side in Side::ALL {
            let Some(receiver) = grid.neighbour(node, side) else { continue };
            grid.gather(messages, node, side, h);
            grid.send(node, receiver, h, messages.received_mut(size.index(receiver), side.opposite()));
        }
    }
}

/// Runs a step in which no message depends on another of the same step.
fn parallel_step(grid: &Grid<'_>, step: u32, messages: &mut Messages, h: &mut [u8]) {
    let size = grid.size;
    let sync = grid.plan.settings().schedule == Schedule::Sync;
    for node in size.nodes().filter(|node| sync || node.is_even() == step.is_multiple_of(2)) {
        for side in Side::ALL {
            let Some(receiver) = grid.neighbour(node, side) else { continue };
            grid.gather(messages, node, side, h);
            let (index, from) = (size.index(receiver), side.opposite());
            let slot = if sync { messages.next_mut(index, from) } else { messages.received_mut(index, from) };
            grid.send(node, receiver, h, slot);
        }
    }
    if sync {
        messages.swap();
    }
}
