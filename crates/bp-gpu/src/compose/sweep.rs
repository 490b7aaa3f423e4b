//! The schedule `sweep`: all bands at the same time, their rows one after another.

use std::ops::Range;

use bp_core::{BAND_ROWS, Seam, Side};

use super::{
    composer::{Composer, Nodes, Rows},
    recorder::PartRecorder,
};
use crate::{Command, Shape, layout::Strip};

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

/// Which way a pass goes through rows.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Direction {
    /// Down: even nodes lead.
    Forward,
    /// Up: odd nodes lead.
    Backward,
}

/// A pass of messages through rows of bands. The leading colour of each row sends left, right and ahead, then the other one ahead.
pub(super) struct Pass {
    pub(super) grid: usize,
    pub(super) bands: Bands,
    pub(super) direction: Direction,
    /// Counted from the first row of the band.
    pub(super) rows: Range<usize>,
    /// Whether the last row sends ahead, across a seam or to rows that do not take part.
    pub(super) across: bool,
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
        for direction in [Direction::Forward, Direction::Backward] {
            self.pass(part, &Pass { grid, bands: Bands::All, direction, rows: 0..BAND_ROWS, across: false });
        }
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
        let (above, below) = (BAND_ROWS - Seam::ROWS_ABOVE..BAND_ROWS, 0..Seam::ROWS_BELOW);
        let pass =
            |bands, direction, rows: &Range<usize>, across| Pass { grid, bands, direction, rows: rows.clone(), across };
        let labelled = BAND_ROWS - Seam::LABEL_ROWS..BAND_ROWS;
        self.pass(part, &pass(Bands::AboveSeams, Direction::Forward, &above, true));
        self.join_strips(part, grid, 0, &[Side::Down]);
        part.push_short(Command::Barrier);
        self.pass(part, &pass(Bands::BelowSeams, Direction::Forward, &below, false));
        self.pass(part, &pass(Bands::BelowSeams, Direction::Backward, &below, true));
        self.join_strips(part, grid, 0, &[Side::Up]);
        part.push_short(Command::Barrier);
        if self.plan.decides_labels(grid) {
            self.pass(part, &pass(Bands::AboveSeams, Direction::Backward, &labelled, true));
            self.decode_seams(part, grid, labelled.clone());
            self.refine_again(part, grid, Bands::AboveSeams, labelled, &BACKWARD);
        }
        self.refine_again(part, grid, Bands::BelowSeams, 0..1, &HORIZONTAL);
        self.refine_again(part, grid, Bands::BelowSeams, 1..Seam::ROWS_BELOW, &BACKWARD);
        part.push_short(Command::Barrier);
        self.extend_seams(part, grid);
    }

    fn refine_again(
        &mut self,
        part: &mut PartRecorder,
        grid: usize,
        bands: Bands,
        of_band: Range<usize>,
        sides: &[Side],
    ) {
        for (colour, &side) in [EVEN, ODD].into_iter().flat_map(|colour| sides.iter().map(move |side| (colour, side))) {
            for (nodes, rows) in self.rows_of_bands(BandRow { grid, bands, colour, row: of_band.start }, of_band.len())
            {
                if self.starts(nodes, side) {
                    self.refine_rows(part, nodes, side, rows);
                }
            }
        }
    }

    /// Records a pass: at once, or row by row.
    fn pass(&mut self, part: &mut PartRecorder, pass: &Pass) {
        if self.limits.shape == Shape::Slices {
            return self.pass_rows(part, pass);
        }
        let (leading, sides): (_, &[Side]) = match pass.direction {
            Direction::Forward => (EVEN, &FORWARD),
            Direction::Backward => (ODD, &BACKWARD),
        };
        let &Pass { grid, bands, ref rows, across, .. } = pass;
        for before in 0..rows.len() {
            let sends_ahead = across || before + 1 < rows.len();
            let row = if leading == EVEN { rows.start + before } else { rows.end - 1 - before };
            let to = if sends_ahead { sides } else { &HORIZONTAL };
            self.send(part, BandRow { grid, bands, colour: leading, row }, to);
            if sends_ahead {
                self.send(part, BandRow { grid, bands, colour: 1 - leading, row }, &sides[HORIZONTAL.len()..]);
            }
        }
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

    /// Records the labels of every band. Above its first row are the labels that were decided for the seam.
    pub(super) fn decode(&mut self, part: &mut PartRecorder, grid: usize) {
        if self.limits.shape == Shape::Slices {
            return self.decide_rows(part, grid, Bands::All, &(0..BAND_ROWS));
        }
        for row in 0..BAND_ROWS {
            self.decode_row(part, grid, Bands::All, row, true);
        }
    }

    /// Records the labels of these rows above seams, which have no labels above them.
    fn decode_seams(&mut self, part: &mut PartRecorder, grid: usize, rows: Range<usize>) {
        if self.limits.shape == Shape::Slices {
            return self.decide_rows(part, grid, Bands::AboveSeams, &rows);
        }
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
    fn band_rows(&self, at: BandRow) -> Vec<(Nodes, Rows)> {
        self.rows_of_bands(at, 1)
    }

    /// The same, with the rows that follow, `span` in all.
    pub(super) fn rows_of_bands(&self, at: BandRow, span: usize) -> Vec<(Nodes, Rows)> {
        let BandRow { grid, bands, colour, row } = at;
        let seams = Seam::all(self.grids[grid].size.height).len();
        let strips = self.grids[grid].strips.iter().enumerate();
        let rows = strips.map(|(strip, &Strip { first, rows })| {
            let bands_before = first / BAND_ROWS;
            let skipped = usize::from(matches!(bands, Bands::BelowSeams) && bands_before == 0);
            let most = if matches!(bands, Bands::AboveSeams) { seams - seams.min(bands_before) } else { usize::MAX };
            let count = rows.saturating_sub(row).div_ceil(BAND_ROWS).min(most).saturating_sub(skipped);
            (Nodes { grid, strip, colour }, Rows { first: row + skipped * BAND_ROWS, step: BAND_ROWS, count, span })
        });
        rows.filter(|(_, rows)| rows.count > 0).collect()
    }
}
