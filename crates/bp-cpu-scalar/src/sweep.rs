//! Message passing under the schedule `sweep`.

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
        sweep.band(first, (first + BAND_ROWS).min(height) - 1);
    }
}

/// A loop over one grid.
struct Sweep<'a> {
    grid: &'a Grid<'a>,
    messages: &'a mut Messages,
    h: &'a mut [u8],
}

impl Sweep<'_> {
    /// Passes forward and backward through the band from row `first` to row `last`.
    fn band(&mut self, first: usize, last: usize) {
        for y in first..last {
            self.send_from(y, Parity::Even, &[Side::Left, Side::Right, Side::Down]);
            self.send_from(y, Parity::Odd, &[Side::Down]);
        }
        self.send_from(last, Parity::Even, &[Side::Left, Side::Right]);
        for y in (first + 1..=last).rev() {
            self.send_from(y, Parity::Odd, &[Side::Left, Side::Right, Side::Up]);
            self.send_from(y, Parity::Even, &[Side::Up]);
        }
        self.send_from(first, Parity::Odd, &[Side::Left, Side::Right]);
    }

    /// Sends from the even or the odd nodes of row y to these sides.
    fn send_from(&mut self, y: usize, parity: Parity, sides: &[Side]) {
        let size = self.grid.size;
        for node in row_nodes(size, y, parity) {
            for &to in sides {
                let Some(receiver) = self.grid.neighbour(node, to) else { continue };
                self.grid.gather(self.messages, node, to, self.h);
                let slot = self.messages.received_mut(size.index(receiver), to.opposite());
                self.grid.send(node, receiver, self.h, slot);
            }
            // Clear received messages only now: a message from one side is part of the messages to the others.
            for &to in sides {
                self.messages.received_mut(size.index(node), to).fill(0);
            }
        }
    }
}
