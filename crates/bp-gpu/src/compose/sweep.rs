//! The schedule `sweep`: all bands at the same time, their rows one after another.

use std::ops::Range;

use bp_core::{BAND_ROWS, Seam, Side};

use super::{
    composer::{Composer, Nodes, Rows},
    recorder::PartRecorder,
};
use crate::{Command, layout::Strip};

const EVEN: usize = 0;
const ODD: usize = 1;
const HORIZONTAL: [Side; 2] = [Side::Left, Side::Right];
const FORWARD: [Side; 3] = [Side::Left, Side::Right, Side::Down];
const BACKWARD: [Side; 3] = [Side::Left, Side::Right, Side::Up];

/// Which bands take part.
#[derive(Clone, Copy)]
pub(super) enum Bands {
    All,
    /// Those with a seam above.
    BelowSeams,
    /// Those with a seam below.
    AboveSeams,
}

/// The nodes of one colour in the same row of some bands of a grid.
#[derive(Clone, Copy)]
pub(super) struct BandRow {
    pub(super) grid: usize,
    pub(super) bands: Bands,
    pub(super) colour: usize,
    /// Counted from the first row of the band.
    pub(super) row: usize,
}

impl Composer<'_> {
    /// Records one loop on a grid, forward and backward through every band; see [`bp_core::Schedule::Sweep`].
    pub(super) fn sweep(&mut self, part: &mut PartRecorder, grid: usize) {
        let (bands, last) = (Bands::All, BAND_ROWS - 1);
        for row in 0..last {
            self.forward(part, grid, bands, row);
        }
        self.send(part, BandRow { grid, bands, colour: EVEN, row: last }, &HORIZONTAL);
        for row in (1..=last).rev() {
            self.backward(part, grid, bands, row);
        }
        self.send(part, BandRow { grid, bands, colour: ODD, row: 0 }, &HORIZONTAL);
        if grid > 0 && self.plan.decides_labels(grid) {
            self.decode(part, grid);
        }
        self.extend_bands(part, grid);
        // The finer grid's first messages are interpolated between rows, also across strips.
        self.join_strips(part, grid, 0, &[Side::Left, Side::Right, Side::Up]);
    }

    /// Records what is done for all seams of a grid before its first loop; see [`Seam`]. A message is stored with its sender,
    /// and loops send nothing across seams, so the messages across them stay. What else the first messages need is written
    /// again afterwards.
    pub(super) fn prepare_seams(&mut self, part: &mut PartRecorder, grid: usize) {
        if Seam::all(self.grids[grid].size.height).len() == 0 {
            return;
        }
        self.restrict_seams(part, grid);
        let last_below = Seam::ROWS_BELOW - 1;
        let labelled = BAND_ROWS - Seam::LABEL_ROWS..BAND_ROWS;
        for row in BAND_ROWS - Seam::ROWS_ABOVE..BAND_ROWS {
            self.forward(part, grid, Bands::AboveSeams, row);
        }
        self.join_strips(part, grid, 0, &[Side::Down]);
        part.push_short(Command::Barrier);
        for row in 0..last_below {
            self.forward(part, grid, Bands::BelowSeams, row);
        }
        self.send(part, BandRow { grid, bands: Bands::BelowSeams, colour: EVEN, row: last_below }, &HORIZONTAL);
        for row in (0..Seam::ROWS_BELOW).rev() {
            self.backward(part, grid, Bands::BelowSeams, row);
        }
        self.join_strips(part, grid, 0, &[Side::Up]);
        part.push_short(Command::Barrier);
        if self.plan.decides_labels(grid) {
            for row in labelled.clone().rev() {
                self.backward(part, grid, Bands::AboveSeams, row);
            }
            self.decode_rows(part, grid, labelled.clone());
            labelled.for_each(|row| self.refine_again(part, grid, Bands::AboveSeams, row, &BACKWARD));
        }
        self.refine_again(part, grid, Bands::BelowSeams, 0, &HORIZONTAL);
        (1..Seam::ROWS_BELOW).for_each(|row| self.refine_again(part, grid, Bands::BelowSeams, row, &BACKWARD));
        part.push_short(Command::Barrier);
        self.extend_seams(part, grid);
    }

    fn refine_again(&mut self, part: &mut PartRecorder, grid: usize, bands: Bands, row: usize, sides: &[Side]) {
        for (colour, &side) in [EVEN, ODD].into_iter().flat_map(|colour| sides.iter().map(move |side| (colour, side))) {
            for (nodes, rows) in self.band_rows(BandRow { grid, bands, colour, row }) {
                if self.starts(nodes, side) {
                    self.refine_rows(part, nodes, side, rows);
                }
            }
        }
    }

    fn forward(&mut self, part: &mut PartRecorder, grid: usize, bands: Bands, row: usize) {
        self.send(part, BandRow { grid, bands, colour: EVEN, row }, &FORWARD);
        self.send(part, BandRow { grid, bands, colour: ODD, row }, &[Side::Down]);
    }

    fn backward(&mut self, part: &mut PartRecorder, grid: usize, bands: Bands, row: usize) {
        self.send(part, BandRow { grid, bands, colour: ODD, row }, &BACKWARD);
        self.send(part, BandRow { grid, bands, colour: EVEN, row }, &[Side::Up]);
    }

    /// Records that these nodes send to these sides.
    fn send(&mut self, part: &mut PartRecorder, at: BandRow, sides: &[Side]) {
        let pipeline = self.update_pipeline(sides.len(), true);
        for (nodes, rows) in self.band_rows(at) {
            let mut work = self.work(nodes, rows);
            work.parameters.sends = sides.iter().map(|&side| 1 << side as u32).sum();
            let bound = self.messages(nodes, 0, 0);
            self.dispatch(part, pipeline.clone(), bound, work);
        }
        part.push_short(Command::Barrier);
    }

    /// Records the labels of every band. Above its first row are the labels that were decided for the seam.
    pub(super) fn decode(&mut self, part: &mut PartRecorder, grid: usize) {
        for row in 0..BAND_ROWS {
            self.decode_row(part, grid, Bands::All, row, true);
        }
    }

    /// Records the labels of these rows above seams, which have no labels above them.
    fn decode_rows(&mut self, part: &mut PartRecorder, grid: usize, rows: Range<usize>) {
        for row in rows.clone() {
            self.decode_row(part, grid, Bands::AboveSeams, row, row > rows.start);
        }
    }

    /// Records the labels of a row, first for its even nodes.
    fn decode_row(&mut self, part: &mut PartRecorder, grid: usize, bands: Bands, row: usize, labels_above: bool) {
        for colour in [EVEN, ODD] {
            for (nodes, rows) in self.band_rows(BandRow { grid, bands, colour, row }) {
                let mut work = self.work(nodes, rows);
                work.parameters.labels_above = labels_above.into();
                self.select(part, nodes, work);
            }
            part.push_short(Command::Barrier);
        }
    }

    /// The nodes and rows of a [`BandRow`] in each strip that has any. Strips begin with a band.
    pub(super) fn band_rows(&self, at: BandRow) -> Vec<(Nodes, Rows)> {
        let BandRow { grid, bands, colour, row } = at;
        let seams = Seam::all(self.grids[grid].size.height).len();
        let strips = self.grids[grid].strips.iter().enumerate();
        let rows = strips.map(|(strip, &Strip { first, rows })| {
            let bands_before = first / BAND_ROWS;
            let skipped = usize::from(matches!(bands, Bands::BelowSeams) && bands_before == 0);
            let most = if matches!(bands, Bands::AboveSeams) { seams - seams.min(bands_before) } else { usize::MAX };
            let count = rows.saturating_sub(row).div_ceil(BAND_ROWS).min(most).saturating_sub(skipped);
            (Nodes { grid, strip, colour }, Rows { first: row + skipped * BAND_ROWS, step: BAND_ROWS, count })
        });
        rows.filter(|(_, rows)| rows.count > 0).collect()
    }
}
