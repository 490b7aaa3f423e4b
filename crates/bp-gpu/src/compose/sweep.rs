//! The schedule `sweep`: processes all bands at the same time, and their rows one after another.

use bp_core::{BAND_ROWS, Side};

use super::{
    composer::{Composer, Nodes, Rows},
    recorder::PartRecorder,
};
use crate::Command;

const EVEN: usize = 0;
const ODD: usize = 1;

/// The nodes of one colour in the same row of every band of a grid.
#[derive(Clone, Copy)]
struct BandRow {
    grid: usize,
    colour: usize,
    /// Counted from the first row of the band.
    row: usize,
}

impl Composer<'_> {
    /// Records one loop on a grid: forward and backward through every band; see [`bp_core::Schedule::Sweep`].
    pub(super) fn sweep(&mut self, part: &mut PartRecorder, grid: usize) {
        let (last, horizontal) = (BAND_ROWS - 1, [Side::Left, Side::Right]);
        for row in 0..last {
            self.send(part, BandRow { grid, colour: EVEN, row }, &[Side::Left, Side::Right, Side::Down]);
            self.send(part, BandRow { grid, colour: ODD, row }, &[Side::Down]);
        }
        self.send(part, BandRow { grid, colour: EVEN, row: last }, &horizontal);
        for row in (1..=last).rev() {
            self.send(part, BandRow { grid, colour: ODD, row }, &[Side::Left, Side::Right, Side::Up]);
            self.send(part, BandRow { grid, colour: EVEN, row }, &[Side::Up]);
        }
        self.send(part, BandRow { grid, colour: ODD, row: 0 }, &horizontal);
    }

    /// Records that these nodes send to these sides.
    fn send(&mut self, part: &mut PartRecorder, at: BandRow, sides: &[Side]) {
        let pipeline = self.update_pipeline(true);
        for (nodes, rows) in self.band_rows(at) {
            let mut work = self.work(nodes, rows);
            work.parameters.sends = sides.iter().map(|&side| 1 << side as u32).sum();
            let bound = self.messages(nodes, 0, 0);
            self.dispatch(part, pipeline.clone(), bound, work);
        }
        part.push_short(Command::Barrier);
    }

    /// Records label selection in every band from its top row to its bottom row, in each row first for even nodes.
    pub(super) fn decode(&mut self, part: &mut PartRecorder) {
        for (row, colour) in (0..BAND_ROWS).flat_map(|row| [(row, EVEN), (row, ODD)]) {
            for (nodes, rows) in self.band_rows(BandRow { grid: 0, colour, row }) {
                self.select(part, nodes, self.work(nodes, rows));
            }
            part.push_short(Command::Barrier);
        }
    }

    /// The nodes and rows of a [`BandRow`] in each strip that has any. Strips begin with a band.
    fn band_rows(&self, at: BandRow) -> Vec<(Nodes, Rows)> {
        let BandRow { grid, colour, row } = at;
        let strips = self.grids[grid].strips.iter().enumerate();
        let rows = strips.map(|(strip, &layout)| {
            let count = layout.rows.saturating_sub(row).div_ceil(BAND_ROWS);
            (Nodes { grid, strip, colour }, Rows { first: row, step: BAND_ROWS, count })
        });
        rows.filter(|(_, rows)| rows.count > 0).collect()
    }
}
