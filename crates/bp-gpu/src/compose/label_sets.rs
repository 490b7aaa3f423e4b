//! Label sets; see [`bp_core::Settings::label_sets`]. Buffers keep all labels. Those that a set lacks are made impossible by
//! their data costs.

use std::ops::Range;

use bp_core::{BAND_ROWS, LabelSet, Patch, Seam, Side};

use super::{
    composer::{Composer, Nodes, Rows, Work},
    recorder::PartRecorder,
    sweep::{BandRow, Bands},
};
use crate::{Command, Kernel, Pipeline};

impl Composer<'_> {
    /// Records the sets and costs of the rows around all seams of a grid, if it has label sets.
    pub(super) fn restrict_seams(&mut self, part: &mut PartRecorder, grid: usize) {
        if !self.plan.has_label_sets(grid) {
            return;
        }
        self.find_sets(part, grid, true);
        let above = (Bands::AboveSeams, BAND_ROWS - Seam::ROWS_ABOVE..BAND_ROWS);
        let below = (Bands::BelowSeams, 0..Seam::ROWS_BELOW);
        for (bands, of_band) in [above, below] {
            for (nodes, rows) in self.of_both_colours(grid, bands, of_band) {
                let work = self.work(nodes, rows);
                self.restrict(part, nodes, work, true);
            }
        }
        part.push_short(Command::Barrier);
    }

    /// Records the sets and costs of all bands of a grid, if it has label sets.
    pub(super) fn restrict_bands(&mut self, part: &mut PartRecorder, grid: usize) {
        if !self.plan.has_label_sets(grid) {
            return;
        }
        self.find_sets(part, grid, false);
        for nodes in self.nodes(grid) {
            let work = self.all_rows(nodes);
            self.restrict(part, nodes, work, false);
        }
        part.push_short(Command::Barrier);
    }

    /// Records that the messages across all seams of a grid get values for all labels, if it has label sets.
    pub(super) fn extend_seams(&mut self, part: &mut PartRecorder, grid: usize) {
        if !self.plan.has_label_sets(grid) {
            return;
        }
        let above = (Bands::AboveSeams, BAND_ROWS - 1..BAND_ROWS, Side::Down);
        let below = (Bands::BelowSeams, 0..1, Side::Up);
        for (bands, of_band, side) in [above, below] {
            for (nodes, rows) in self.of_both_colours(grid, bands, of_band) {
                let work = self.work(nodes, rows);
                self.extend(part, nodes, work, side, true);
            }
        }
        part.push_short(Command::Barrier);
        self.join_strips(part, grid, 0, &[Side::Down, Side::Up]);
        part.push_short(Command::Barrier);
    }

    /// Records that the messages that the next finer grid's first ones are made from get values for all labels, if the grid
    /// has label sets.
    pub(super) fn extend_bands(&mut self, part: &mut PartRecorder, grid: usize) {
        if grid == 0 || !self.plan.has_label_sets(grid) {
            return;
        }
        for (nodes, side) in self.nodes(grid).flat_map(|nodes| Side::ALL.map(|side| (nodes, side))) {
            if self.starts(nodes, side) {
                let work = self.all_rows(nodes);
                self.extend(part, nodes, work, side, false);
            }
        }
        part.push_short(Command::Barrier);
    }

    fn of_both_colours(&self, grid: usize, bands: Bands, rows: Range<usize>) -> Vec<(Nodes, Rows)> {
        let of_colour = |colour| self.rows_of_bands(BandRow { grid, bands, colour, row: rows.start }, rows.len());
        [0, 1].into_iter().flat_map(of_colour).collect()
    }

    /// Records the sets of all seams or of all bands of a grid.
    fn find_sets(&mut self, part: &mut PartRecorder, grid: usize, seams: bool) {
        let Some(sets) = self.buffers.label_sets else { return };
        let size = self.grids[grid].size;
        let count = if seams { Seam::all(size.height).len() } else { size.height.div_ceil(BAND_ROWS) };
        let from = self.grids[grid + 1].strips[0];
        let work = self.reading(self.whole_grid(grid, 0), grid + 1, from);
        let row_items = size.width.div_ceil(Patch::COLUMNS);
        let mut work = Work { row_items, rows: Rows::from_top(count), ..work };
        work.parameters.seams = seams.into();
        let constants = vec![("AGREEING", LabelSet::agreeing(grid).into())];
        let pipeline = Pipeline { kernel: Kernel::LabelSets, constants };
        self.dispatch(part, pipeline, vec![sets, self.buffers.labels[grid + 1]], work);
        part.push_short(Command::Barrier);
    }

    fn restrict(&mut self, part: &mut PartRecorder, nodes: Nodes, mut work: Work, seams: bool) {
        let strip = self.strip(nodes);
        let (Some(sets), Some(sums)) = (self.buffers.label_sets, strip.sums) else { return };
        work.parameters.seams = seams.into();
        let constants = vec![("SUM_BYTES", self.grids[nodes.grid].sum_bytes as u32)];
        let pipeline = Pipeline { kernel: Kernel::RestrictCosts, constants };
        let bound = vec![strip.cost[nodes.colour], sums[nodes.colour], sets];
        self.dispatch(part, pipeline, bound, work);
    }

    fn extend(&mut self, part: &mut PartRecorder, nodes: Nodes, mut work: Work, side: Side, seams: bool) {
        let Some(sets) = self.buffers.label_sets else { return };
        work.parameters.seams = seams.into();
        work.parameters.side = side as u32;
        let pipeline = Pipeline { kernel: Kernel::ExtendMessages, constants: Vec::new() };
        let bound = vec![self.strip(nodes).sent[0][side as usize][nodes.colour], sets];
        self.dispatch(part, pipeline, bound, work);
    }
}
