//! [`bp_core::Schedule::Sweep`]: sweeps every band of rows independently, in cache.

use bp_core::{BAND_ROWS, Plan, Side};
use fearless_simd::Level;
use rayon::prelude::*;

use crate::{
    edges::{self, Edges, Rows},
    layout::Layout,
    match_cost::Matching,
    pass::{Pass, Way},
    refine::Coarser,
    select_labels::Answer,
    shape::PlaneRow,
    update_messages::Sends,
    windows::{Window, Windows},
};

/// Where the costs of a grid come from.
pub(crate) enum CostSource<'a> {
    /// They are stored.
    Stored(&'a [u8]),
    /// They are computed when needed, which takes less time than reading them from memory.
    Computed(Matching<'a>),
}

/// The bands of a grid.
pub(crate) struct Bands<'a> {
    pub(crate) level: Level,
    pub(crate) plan: &'a Plan,
    pub(crate) layout: &'a Layout,
    pub(crate) costs: CostSource<'a>,
    pub(crate) coarser: Option<Coarser<'a>>,
    pub(crate) windows: &'a Windows,
}

impl Bands<'_> {
    /// Sweeps all bands and keeps their messages.
    pub(crate) fn keep_messages(&self, edges: &mut Edges) {
        edges.bands_mut(self.layout, BAND_ROWS).enumerate().for_each(|(index, kept)| {
            self.sweep(index, |_, rows| {
                kept.copy_from_slice(&edges::inside_and_down(self.layout, rows)[..kept.len()]);
            });
        });
    }

    /// Sweeps all bands and decides their labels.
    pub(crate) fn decode(&self, labels: &mut [u16]) {
        let bands = labels.par_chunks_mut(BAND_ROWS * self.layout.size.width);
        bands.enumerate().for_each(|(index, labels)| {
            self.sweep(index, |costs, rows| self.answer(index, costs, rows).decode_band(labels));
        });
    }

    /// Sweeps all bands again and copies the messages received from `side`, `[height][width][labels]`.
    pub(crate) fn read_messages(&self, side: Side, messages: &mut [u8]) {
        let bands = messages.par_chunks_mut(BAND_ROWS * self.layout.size.width * self.layout.labels);
        bands.enumerate().for_each(|(index, messages)| {
            self.sweep(index, |costs, rows| self.answer(index, costs, rows).read_messages(self.plan, side, messages));
        });
    }

    fn answer<'a>(&'a self, index: usize, stored: &'a [u8], rows: &'a [u8]) -> Answer<'a> {
        let first = index * BAND_ROWS;
        let rows = Rows::new(self.layout, first, rows);
        let (level, model, layout) = (self.level, self.plan.model(), self.layout);
        Answer { level, model, layout, first, stored, received: [rows, rows] }
    }

    /// Sweeps a band as often as the plan requires, then calls `then` with its costs and edges.
    fn sweep<R>(&self, index: usize, then: impl FnOnce(&[u8], &[u8]) -> R) -> R {
        let (first, row) = (index * BAND_ROWS, self.layout.row());
        let end = (first + BAND_ROWS).min(self.layout.size.height);
        self.windows.with(|Window { costs, edges }| {
            let costs = match &self.costs {
                CostSource::Stored(stored) => &stored[first * row..end * row],
                CostSource::Computed(matching) => {
                    let rows = (first..end).zip(costs.chunks_exact_mut(row));
                    rows.for_each(|(y, stored)| matching.narrow_row(y, stored, None));
                    &*costs
                }
            };
            let Self { level, plan, layout, coarser, .. } = *self;
            let band = Band {
                pass: Pass { level, plan, layout, first, costs, coarser, keeps_messages: false },
                first,
                last: end - 1,
            };
            (0..plan.settings().steps).for_each(|step| band.sweep(step == 0, edges));
            then(costs, edges)
        })
    }
}

/// One band.
struct Band<'a> {
    pass: Pass<'a>,
    first: usize,
    last: usize,
}

impl Band<'_> {
    /// Runs one loop. No message comes from above the band. Those from below are the first messages.
    fn sweep(&self, first_loop: bool, rows: &mut [u8]) {
        let row_bytes = edges::row_bytes(self.pass.layout);
        for plane in 0..2 {
            edges::slots(self.pass.layout, rows, plane)[2].fill(0);
        }
        for y in self.first..=self.last {
            self.forward(y, first_loop, &mut rows[(y - self.first) * row_bytes..]);
        }
        for y in (self.first..=self.last).rev() {
            self.backward(y, &mut rows[(y - self.first) * row_bytes..]);
        }
    }

    /// Even nodes send left, right and down; then odd nodes send down. The last row sends nothing down.
    fn forward(&self, y: usize, first_loop: bool, rows: &mut [u8]) {
        let (even, odd) = planes(y);
        let last = y == self.last;
        if first_loop {
            self.pass.refine(even, &[Side::Left, Side::Right, Side::Down], rows);
            if last {
                self.pass.refine(odd, &[Side::Down], rows);
            }
        }
        self.pass.send(Way::Down, even, if last { Sends::Sides } else { Sends::SidesAndOn }, rows);
        if !last {
            self.pass.send(Way::Down, odd, Sends::On, rows);
        }
    }

    /// Odd nodes send left, right and up; then even nodes send up. The first row sends nothing up.
    fn backward(&self, y: usize, rows: &mut [u8]) {
        let (even, odd) = planes(y);
        let first = y == self.first;
        self.pass.send(Way::Up, odd, if first { Sends::Sides } else { Sends::SidesAndOn }, rows);
        if !first {
            self.pass.send(Way::Up, even, Sends::On, rows);
        }
    }
}

/// The even and the odd nodes of row y.
fn planes(y: usize) -> (PlaneRow, PlaneRow) {
    (PlaneRow { plane: y % 2, y }, PlaneRow { plane: 1 - y % 2, y })
}
