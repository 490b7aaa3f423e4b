//! Message passing under the schedule `sweep`.

use bp_core::{BAND_ROWS, Plan, Side};

use crate::{
    costs::Costs,
    greys::Greys,
    messages::Messages,
    update_messages::{gather, send},
};

/// Remainder of even nodes' x + y modulo 2.
pub(crate) const EVEN: usize = 0;
/// Remainder of odd ones.
pub(crate) const ODD: usize = 1;

/// Runs one loop on `grid`, see [`bp_core::Schedule::Sweep`]. `h` is room for one message.
pub(crate) fn sweep(plan: &Plan, grid: usize, costs: &Costs, greys: &Greys, messages: &mut Messages, h: &mut [u8]) {
    let height = plan.size(grid).height;
    let mut sweep = Sweep { plan, grid, costs, greys, messages, h };
    for first in (0..height).step_by(BAND_ROWS) {
        sweep.band(first, (first + BAND_ROWS).min(height) - 1);
    }
}

/// The even or the odd nodes of row y, as columns.
pub(crate) fn row_nodes(width: usize, y: usize, parity: usize) -> impl Iterator<Item = usize> {
    ((y + parity) % 2..width).step_by(2)
}

/// A loop that is under way.
struct Sweep<'a> {
    plan: &'a Plan,
    grid: usize,
    costs: &'a Costs,
    greys: &'a Greys,
    messages: &'a mut Messages,
    h: &'a mut [u8],
}

impl Sweep<'_> {
    /// Forward and backward through the band of these first and last rows.
    fn band(&mut self, first: usize, last: usize) {
        for y in first..last {
            self.send_from(y, EVEN, &[Side::Left, Side::Right, Side::Down]);
            self.send_from(y, ODD, &[Side::Down]);
        }
        self.send_from(last, EVEN, &[Side::Left, Side::Right]);
        for y in (first + 1..=last).rev() {
            self.send_from(y, ODD, &[Side::Left, Side::Right, Side::Up]);
            self.send_from(y, EVEN, &[Side::Up]);
        }
        self.send_from(first, ODD, &[Side::Left, Side::Right]);
    }

    /// The even or the odd nodes of row y send to these sides.
    fn send_from(&mut self, y: usize, parity: usize, sides: &[Side]) {
        let width = self.plan.size(self.grid).width;
        for x in row_nodes(width, y, parity) {
            let node = y * width + x;
            for &to in sides {
                let Some((to_x, to_y)) = self.plan.neighbour(self.grid, (x, y), to) else { continue };
                gather(self.costs, self.messages, node, to, self.h);
                let receiver = to_y * width + to_x;
                let slot = self.messages.received_mut(receiver, to.opposite());
                send(self.greys.smoothness(node, receiver), self.h, slot);
            }
            // Only now: what came from one side is part of what goes to the others.
            for &to in sides {
                self.messages.received_mut(node, to).fill(0);
            }
        }
    }
}
