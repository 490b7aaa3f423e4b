//! Message passing.

use bp_core::{Schedule, Side};

use crate::{grid::Grid, messages::Messages, sweep::sweep};

/// Runs one step of the plan's schedule on a grid. `h` has room for one message.
pub(crate) fn update_messages(grid: &Grid<'_>, step: u32, messages: &mut Messages, h: &mut [u8]) {
    match grid.plan.settings().schedule {
        Schedule::Sync | Schedule::Checkerboard => parallel_step(grid, step, messages, h),
        Schedule::Sweep => sweep(grid, messages, h),
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
