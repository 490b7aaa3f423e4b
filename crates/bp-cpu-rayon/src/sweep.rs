//! The order of [`bp_core::Schedule::Sweep`]: bands of rows, alternately, each down and up again.

use bp_core::{BAND_ROWS, Side};

use crate::{
    edges,
    solver::Grid,
    update_messages::Sends,
    wavefront::{Chunk, each_band},
};

/// Runs one loop over the rows of a grid's edges.
pub(crate) fn sweep(grid: &Grid<'_>, first_loop: bool, rows: &mut [u8]) {
    let bands = grid.layout.size.height.div_ceil(BAND_ROWS);
    let row_bytes = edges::row_bytes(grid.layout);
    each_band([Chunk { rows, row_bytes }], 0..bands.div_ceil(2), 2 * BAND_ROWS, &|[chunk], index| {
        Band { grid, index: 2 * index, first_loop }.pass(chunk.rows);
    });
    let rows = rows.get_mut(BAND_ROWS * row_bytes..).unwrap_or_default();
    each_band([Chunk { rows, row_bytes }], 0..bands / 2, 2 * BAND_ROWS, &|[chunk], index| {
        Band { grid, index: 2 * index + 1, first_loop }.pass(chunk.rows);
    });
}

struct Band<'a> {
    grid: &'a Grid<'a>,
    index: usize,
    first_loop: bool,
}

impl Band<'_> {
    fn pass(&self, rows: &mut [u8]) {
        let (first, height) = (self.index * BAND_ROWS, self.grid.layout.size.height);
        let last = (first + BAND_ROWS).min(height) - 1;
        let row_bytes = edges::row_bytes(self.grid.layout);
        for plane in 0..2 {
            edges::slots(self.grid.layout, rows, plane).slots[2].fill(0);
        }
        for y in first..=last {
            self.forward(y, y == last, &mut rows[(y - first) * row_bytes..]);
        }
        for y in (first..=last).rev() {
            self.backward(y, &mut rows[(y - first) * row_bytes..]);
        }
    }

    /// Even nodes send to both sides and down, then odd ones down; the last row sends nothing down.
    fn forward(&self, y: usize, last: bool, rows: &mut [u8]) {
        let (even, odd) = (y % 2, 1 - y % 2);
        if self.first_loop {
            // Of an odd band, the next band has already sent something better than a first message up to the last row.
            let from_below = !(last && self.index % 2 == 1 && y + 1 < self.grid.layout.size.height);
            let below: &[Side] = if from_below { &[Side::Down] } else { &[] };
            self.grid.refine((even, y), &[Side::Left, Side::Right], rows);
            self.grid.refine((even, y), below, rows);
            self.grid.refine((odd, y), if last { below } else { &[] }, rows);
        }
        self.grid.send((even, y), if last { Sends::Sides } else { Sends::SidesAndDown }, rows);
        if !last {
            self.grid.send((odd, y), Sends::Down, rows);
        }
    }

    /// Odd nodes send to both sides and up, then even ones up.
    fn backward(&self, y: usize, rows: &mut [u8]) {
        let (even, odd) = (y % 2, 1 - y % 2);
        self.grid.send_up((odd, y), Sends::SidesAndDown, rows);
        self.grid.send_up((even, y), Sends::Down, rows);
    }
}
