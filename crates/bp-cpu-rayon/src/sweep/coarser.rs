//! The next coarser grid, as rows that are passed together see it.

use std::ops::Range;

use bp_core::{BAND_ROWS, EdgeLevels, Error, Patch, Plan};

use super::{Band, made::Made};
use crate::layout::Layout;

/// The bands of the next coarser grid that some rows depend on.
#[derive(Clone, Copy)]
pub(crate) struct Coarser<'a> {
    pub(crate) layout: &'a Layout,
    pub(crate) edges: &'a EdgeLevels,
    /// The index of the first band.
    first: usize,
    /// This band, and the next one if that is needed.
    bands: [&'a Band; 2],
}

impl<'a> Coarser<'a> {
    /// Waits for the bands that these rows of the finer `grid` depend on: for their label sets, and for first messages, which need
    /// fewer rows.
    pub(super) fn wait(
        plan: &'a Plan,
        grid: usize,
        rows: Range<usize>,
        layout: &'a Layout,
        bands: &'a [Made<Band>],
    ) -> Result<Self, Error> {
        let columns = 0..plan.size(grid).width;
        let rows = Patch { columns, rows }.region(layout.size).rows;
        let [first, last] = [rows.start, rows.end - 1].map(|y| y / BAND_ROWS);
        debug_assert!(last <= first + 1, "{rows:?} lie in more than two bands");
        Ok(Self { layout, edges: plan.model().edges(), first, bands: [bands[first].wait()?, bands[last].wait()?] })
    }

    /// The band of this index.
    #[inline(always)]
    pub(super) fn band(&self, index: usize) -> &'a Band {
        self.bands[usize::from(index > self.first)]
    }

    /// The labels that were decided in row y, `[width]`.
    pub(super) fn labels(&self, y: usize) -> &'a [u16] {
        let width = self.layout.size.width;
        &self.band(y / BAND_ROWS).labels[y % BAND_ROWS * width..][..width]
    }
}
