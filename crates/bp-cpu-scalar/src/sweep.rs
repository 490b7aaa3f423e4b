//! Message passing under the schedule `sweep`.

use std::ops::Range;

use bp_core::{BAND_ROWS, Plan, Side};

use crate::{
    costs::Costs,
    messages::Messages,
    update_messages::{gather, send},
};

/// Remainder of even nodes (x + y) and even-numbered bands modulo 2.
pub(crate) const EVEN: usize = 0;
/// Remainder of odd ones.
pub(crate) const ODD: usize = 1;

/// Runs one loop on `grid`, see [`bp_core::Schedule::Sweep`]. `h` is room for one message.
pub(crate) fn sweep(plan: &Plan, grid: usize, costs: &Costs, messages: &mut Messages, h: &mut [u8]) {
    let height = plan.size(grid).height;
    let mut sweep = Sweep { plan, grid, costs, messages, h };
    for rows in bands(height, EVEN).chain(bands(height, ODD)) {
        sweep.band(rows);
    }
}

/// The rows of each even-numbered or each odd-numbered band of a grid.
pub(crate) fn bands(height: usize, parity: usize) -> impl Iterator<Item = Range<usize>> {
    let starts = (parity * BAND_ROWS..height).step_by(2 * BAND_ROWS);
    starts.map(move |start| start..(start + BAND_ROWS).min(height))
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
    messages: &'a mut Messages,
    h: &'a mut [u8],
}

impl Sweep<'_> {
    /// Forward and backward through one band. Nothing needs to be dropped at its upper seam: what was sent up there is
    /// in the slots of the band above, where the first row's next messages replace it before it is read again.
    fn band(&mut self, rows: Range<usize>) {
        let last = rows.end - 1;
        for y in rows.start..last {
            self.send_from(y, EVEN, &[Side::Left, Side::Right, Side::Down]);
            self.send_from(y, ODD, &[Side::Down]);
        }
        self.send_from(last, EVEN, &[Side::Left, Side::Right]);
        for y in rows.rev() {
            self.send_from(y, ODD, &[Side::Left, Side::Right, Side::Up]);
            self.send_from(y, EVEN, &[Side::Up]);
        }
    }

    /// The even or the odd nodes of row y send to these sides.
    fn send_from(&mut self, y: usize, parity: usize, sides: &[Side]) {
        let width = self.plan.size(self.grid).width;
        for x in row_nodes(width, y, parity) {
            let node = y * width + x;
            for &to in sides {
                let Some((to_x, to_y)) = self.plan.neighbour(self.grid, (x, y), to) else { continue };
                gather(self.costs, self.messages, node, to, self.h);
                send(self.plan.model(), self.h, self.messages.received_mut(to_y * width + to_x, to.opposite()));
            }
            // Only now: what came from one side is part of what goes to the others.
            for &to in sides {
                self.messages.received_mut(node, to).fill(0);
            }
        }
    }
}
