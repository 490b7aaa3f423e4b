//! Message passing.

use bp_core::{Plan, Schedule, Side, Smoothness};

use crate::{costs::Costs, greys::Greys, messages::Messages, sweep::sweep};

/// Runs one step of the plan's schedule on `grid`. `h` is room for one message.
pub(crate) fn update_messages(
    plan: &Plan,
    grid: usize,
    step: u32,
    costs: &Costs,
    greys: &Greys,
    messages: &mut Messages,
    h: &mut [u8],
) {
    match plan.settings().schedule {
        Schedule::Sync | Schedule::Checkerboard => parallel_step(plan, grid, step, costs, greys, messages, h),
        Schedule::Sweep => sweep(plan, grid, costs, greys, messages, h),
    }
}

/// A step whose messages depend on none of the same step.
fn parallel_step(
    plan: &Plan,
    grid: usize,
    step: u32,
    costs: &Costs,
    greys: &Greys,
    messages: &mut Messages,
    h: &mut [u8],
) {
    let size = plan.size(grid);
    let sync = plan.settings().schedule == Schedule::Sync;
    for y in 0..size.height {
        for x in 0..size.width {
            if !sync && (x + y + step as usize) % 2 == 1 {
                continue;
            }
            for side in Side::ALL {
                let Some((to_x, to_y)) = plan.neighbour(grid, (x, y), side) else { continue };
                let node = y * size.width + x;
                gather(costs, messages, node, side, h);
                let (receiver, from) = (to_y * size.width + to_x, side.opposite());
                let slot = if sync { messages.next_mut(receiver, from) } else { messages.received_mut(receiver, from) };
                send(greys.smoothness(node, receiver), h, slot);
            }
        }
    }
    if sync {
        messages.swap();
    }
}

/// Sets h to the data cost of `node` plus what it received from all sides but `to`.
pub(crate) fn gather(costs: &Costs, messages: &Messages, node: usize, to: Side, h: &mut [u8]) {
    h.copy_from_slice(costs.of(node));
    for from in Side::ALL.into_iter().filter(|&from| from != to) {
        for (h, &message) in h.iter_mut().zip(messages.received(node, from)) {
            *h = h.saturating_add(message);
        }
    }
}

/// Turns h into a message: `min over a of (h(a) + min(s |a - d|, K))` for every label d, normalised by its minimum,
/// which is h's. A pass up and a pass down the labels make the lower envelope (Felzenszwalb and Huttenlocher 2006).
pub(crate) fn send(smoothness: Smoothness, h: &mut [u8], message: &mut [u8]) {
    let (step, truncation) = (smoothness.step(), smoothness.truncation);
    let least = h.iter().copied().min().unwrap_or(0);
    let mut envelope = u8::MAX;
    for h in h.iter_mut() {
        envelope = envelope.saturating_add(step).min(*h);
        *h = envelope;
    }
    for h in h.iter_mut().rev() {
        envelope = envelope.saturating_add(step).min(*h);
        *h = envelope;
    }
    for (message, &h) in message.iter_mut().zip(&*h) {
        *message = (h - least).min(truncation);
    }
}
