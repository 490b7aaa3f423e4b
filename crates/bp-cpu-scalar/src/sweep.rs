//! Message passing under the schedule `sweep`.

use std::ops::Range;

use bp_core::{BAND_ROWS, Side};

use crate::{
    grid::Grid,
    messages::Messages,
    row::{Parity, row_nodes},
};

/// Runs one loop on a grid; see [`bp_core::Schedule::Sweep`]. `h` has room for one message.
pub(crate) fn sweep(grid: &Grid<'_>, messages: &mut Messages, h: &mut [u8]) {
    let height = grid.size.height;
    let mut sweep = Sweep { grid, messages, h };
    for first in (0..height).step_by(BAND_ROWS) {
        let end = (first + BAND_ROWS).min(height);
        sweep.forward(first..end);
        sweep.backward(first + 1..end, true);
        sweep.backward(first..first + 1, false);
    }
}

/// Passes over rows of one grid.
pub(crate) struct Sweep<'a> {
    pub(crate) grid: &'a Grid<'a>,
    pub(crate) messages: &'a mut Messages,
    pub(crate) h: &'a mut [u8],
}

impl Sweep<'_> {
    /// Passes down these rows. The last one sends nothing down.
    pub(crate) fn forward(&mut self, rows: Range<usize>) {
        for y in rows.start..rows.end - 1 {
            self.send_from(y, Parity::Even, &[Side::Left, Side::Right, Side::Down]);
            self.send_from(y, Parity::Odd, &[Side::Down]);
        }
        self.send_from(rows.end - 1, Parity::Even, &[Side::Left, Side::Right]);
    }

    /// Passes up these rows, which send up only if `onward`.
    pub(crate) fn backward(&mut self, rows: Range<usize>, onward: bool) {
        let up: &[Side] = if onward { &[Side::Up] } else { &[] };
        let sides: &[Side] = if onward { &[Side::Left, Side::Right, Side::Up] } else { &[Side::Left, Side::Right] };
        for y in rows.rev() {
            self.send_from(y, Parity::Odd, sides);
            self.send_from(y, Parity::Even, up);
        }
    }

    /// Sends messages from the even or the odd nodes of row y to these sides.
    fn send_from(&mut self, y: usize, parity: Parity, sides: &[Side]) {
        let size = self.grid.size;
        for node in row_nodes(size, y, parity) {
            for &to in sides {
                let Some(receiver) = self.grid.neighbour(node, to) else { continue };
                self.grid.gather(self.messages, node, to, self.h);
                let slot = self.messages.received_mut(size.index(receiver), to.opposite());
                self.grid.send(node, receiver, self.h, slot);
            }
            // Not earlier: a message received from one side is part of those sent to the others.
            for &to in sides {
                self.messages.received_mut(size.index(node), to).fill(0);
            }
        }
    }
}
