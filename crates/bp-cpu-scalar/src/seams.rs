//! The seams of the schedule `sweep`; see [`bp_core::Seam`].

use bp_core::{BAND_ROWS, Error, Plan, Schedule, Seam, Side, memory};

use crate::{decode::decode_rows, grid::Grid, messages::Messages, sweep::Sweep};

/// What was prepared for the seams of one grid.
pub(crate) struct Seams {
    /// The messages down across each seam, then those up, `[seam][x][label]`.
    messages: [Vec<u8>; 2],
    /// The labels of the rows above each seam that are decided in advance, `[seam][row][x]`.
    labels: Vec<u16>,
}

impl Seams {
    /// Allocates room for the seams of the finest grid, which is enough for every grid.
    pub(crate) fn new(plan: &Plan) -> Result<Self, Error> {
        let size = plan.image_size();
        let swept = plan.settings().schedule == Schedule::Sweep;
        let nodes = if swept { Seam::all(size.height).len() * size.width } else { 0 };
        let messages = || memory::filled("messages", nodes.saturating_mul(plan.model().labels()), 0);
        Ok(Self {
            messages: [messages()?, messages()?],
            labels: memory::filled("labels", nodes * Seam::LABEL_ROWS, 0)?,
        })
    }

    /// Prepares a seam of a grid. `messages` are the grid's first messages, and are overwritten.
    pub(crate) fn prepare(&mut self, seam: Seam, grid: &Grid<'_>, messages: &mut Messages, h: &mut [u8]) {
        let (width, row) = (grid.size.width, messages.row_bytes(grid.size.width));
        let index = seam.below / BAND_ROWS - 1;
        let [down, up] = self.messages.each_mut().map(|messages| &mut messages[index * row..][..row]);
        let mut sweep = Sweep { grid, messages, h };
        sweep.forward(seam.rows());
        down.copy_from_slice(sweep.messages.received_row(width, seam.below, Side::Up));
        sweep.backward(seam.rows_below(), true);
        up.copy_from_slice(sweep.messages.received_row(width, seam.below - 1, Side::Down));
        if grid.plan.decides_labels(grid.index) {
            sweep.backward(seam.label_rows(), true);
            let labels = &mut self.labels[index * Seam::LABEL_ROWS * width..][..Seam::LABEL_ROWS * width];
            decode_rows(grid, messages, seam.label_rows(), None, labels, h);
        }
    }

    /// Gives the rows beside the seams of a grid the messages that they hold in all loops.
    pub(crate) fn apply(&self, grid: &Grid<'_>, messages: &mut Messages) {
        let (width, row) = (grid.size.width, messages.row_bytes(grid.size.width));
        for (index, seam) in Seam::all(grid.size.height).enumerate() {
            let [down, up] = self.messages.each_ref().map(|messages| &messages[index * row..][..row]);
            messages.received_row_mut(width, seam.below, Side::Up).copy_from_slice(down);
            messages.received_row_mut(width, seam.below - 1, Side::Down).copy_from_slice(up);
        }
    }

    /// Writes the label of every node in the order of [`Schedule::Sweep`]. `sums` has room for one node's labels.
    pub(crate) fn decode(&self, grid: &Grid<'_>, messages: &Messages, labels: &mut [u16], sums: &mut [u8]) {
        let width = grid.size.width;
        for (band, labels) in labels.chunks_mut(BAND_ROWS * width).enumerate() {
            let first = band * BAND_ROWS;
            let rows = first..first + labels.len() / width;
            decode_rows(grid, messages, rows, self.labels_above(width, band), labels, sums);
        }
    }

    /// The labels of the row above a band; `None` above the first one.
    fn labels_above(&self, width: usize, band: usize) -> Option<&[u16]> {
        let labels = self.labels.chunks_exact(Seam::LABEL_ROWS * width).nth(band.checked_sub(1)?)?;
        labels.chunks_exact(width).last()
    }

    /// The bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        self.messages.iter().map(memory::bytes).sum::<u64>() + memory::bytes(&self.labels)
    }
}
