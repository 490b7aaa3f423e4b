//! [`bp_core::Schedule::Sweep`]: sweeps every band of rows independently, in cache.

use std::ops::Range;

use bp_core::{BAND_ROWS, Plan, Seam, Side};
use fearless_simd::Level;
use rayon::prelude::*;

use crate::{
    edges::{self, Edges, Rows},
    layout::Layout,
    match_cost::Matching,
    pass::{Pass, Way},
    refine::Coarser,
    seams::{PreparedMut, Seams},
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

/// A grid that is swept.
pub(crate) struct Sweep<'a> {
    pub(crate) level: Level,
    pub(crate) plan: &'a Plan,
    pub(crate) layout: &'a Layout,
    pub(crate) costs: CostSource<'a>,
    pub(crate) coarser: Option<Coarser<'a>>,
    pub(crate) windows: &'a Windows,
}

impl Sweep<'_> {
    /// Prepares all seams. Their labels are decided only if `decides`.
    pub(crate) fn prepare(&self, seams: &mut Seams, decides: bool) {
        seams.all_mut(self.layout).for_each(|(seam, prepared)| self.prepare_seam(seam, prepared, decides));
    }

    fn prepare_seam(&self, seam: Seam, prepared: PreparedMut<'_>, decides: bool) {
        self.with_rows(seam.rows(), |rows, edges| {
            edges::up(self.layout, edges).fill(0);
            rows.forward(Start::Refined, edges);
            prepared.down.copy_from_slice(edges::up(self.layout, rows.from(seam.below, edges)));
            rows.backward(seam.rows_below(), edges);
            prepared.up.copy_from_slice(edges::up(self.layout, rows.from(seam.below, edges)));
            if decides {
                rows.backward(seam.label_rows(), edges);
                self.answer(rows, seam.label_rows().start, edges).decode_band(None, prepared.labels);
            }
        });
    }

    /// Sweeps all bands and keeps their messages.
    pub(crate) fn keep_messages(&self, seams: &Seams, edges: &mut Edges) {
        edges.bands_mut(self.layout, BAND_ROWS).enumerate().for_each(|(index, kept)| {
            self.sweep(index, seams, |_, edges| {
                kept.copy_from_slice(&edges::inside_and_down(self.layout, edges)[..kept.len()]);
            });
        });
    }

    /// Sweeps all bands and decides their labels.
    pub(crate) fn decode(&self, seams: &Seams, labels: &mut [u16]) {
        let bands = labels.par_chunks_mut(BAND_ROWS * self.layout.size.width);
        bands.enumerate().for_each(|(index, labels)| {
            let above = above(index).and_then(|seam| seams.get(self.layout, seam)).map(|seam| seam.labels);
            self.sweep(index, seams, |rows, edges| self.answer(rows, rows.first, edges).decode_band(above, labels));
        });
    }

    /// Sweeps all bands again and copies the messages received from `side`, `[height][width][labels]`.
    pub(crate) fn read_messages(&self, seams: &Seams, side: Side, messages: &mut [u8]) {
        let bands = messages.par_chunks_mut(BAND_ROWS * self.layout.size.width * self.layout.labels);
        bands.enumerate().for_each(|(index, messages)| {
            self.sweep(index, seams, |rows, edges| {
                self.answer(rows, rows.first, edges).read_messages(self.plan, side, messages);
            });
        });
    }

    fn answer<'a>(&'a self, rows: &'a SweptRows<'_>, first: usize, edges: &'a [u8]) -> Answer<'a> {
        let row = first - rows.first;
        let received = Rows::new(self.layout, first, &edges[row * edges::row_bytes(self.layout)..]);
        let (level, model, layout) = (self.level, self.plan.model(), self.layout);
        let stored = &rows.pass.costs[row * layout.row()..];
        Answer { level, model, layout, first, stored, received: [received, received] }
    }

    /// Sweeps a band as often as the plan requires, then calls `then` with its rows and edges.
    fn sweep(&self, index: usize, seams: &Seams, then: impl FnOnce(&SweptRows<'_>, &[u8])) {
        let first = index * BAND_ROWS;
        let end = (first + BAND_ROWS).min(self.layout.size.height);
        self.with_rows(first..end, |rows, edges| {
            match above(index).and_then(|seam| seams.get(self.layout, seam)) {
                Some(seam) => edges::up(self.layout, edges).copy_from_slice(seam.down),
                None => edges::up(self.layout, edges).fill(0),
            }
            let mut start = Start::Refined;
            if let Some(seam) = seams.get(self.layout, index) {
                edges::up(self.layout, rows.from(end, edges)).copy_from_slice(seam.up);
                start = Start::RefinedAboveSeam;
            }
            for _ in 0..self.plan.settings().steps {
                rows.forward(start, edges);
                rows.backward(first..end, edges);
                start = Start::Held;
            }
            then(rows, edges);
        });
    }

    /// Calls `work` with these rows and with memory for their edges.
    fn with_rows(&self, rows: Range<usize>, work: impl FnOnce(&SweptRows<'_>, &mut [u8])) {
        let row = self.layout.row();
        self.windows.with(|Window { costs, edges }| {
            let costs = match &self.costs {
                CostSource::Stored(stored) => &stored[rows.start * row..rows.end * row],
                CostSource::Computed(matching) => {
                    let rows = rows.clone().zip(costs.chunks_exact_mut(row));
                    rows.for_each(|(y, stored)| matching.narrow_row(y, stored, None));
                    &*costs
                }
            };
            let Self { level, plan, layout, coarser, .. } = *self;
            let pass = Pass { level, plan, layout, first: rows.start, costs, coarser, keeps_messages: false };
            work(&SweptRows { pass, first: rows.start, end: rows.end }, edges);
        });
    }
}

/// The seam above a band.
fn above(band: usize) -> Option<usize> {
    band.checked_sub(1)
}

/// Rows that are swept together: a band, or those around a seam.
struct SweptRows<'a> {
    pass: Pass<'a>,
    first: usize,
    end: usize,
}
impl SweptRows<'_> {
    /// The edges from row y on.
    fn from<'e>(&self, y: usize, edges: &'e mut [u8]) -> &'e mut [u8] {
        &mut edges[(y - self.first) * edges::row_bytes(self.pass.layout)..]
    }

    /// Passes down all rows.
    fn forward(&self, start: Start, edges: &mut [u8]) {
        for y in self.first..self.end {
            self.forward_row(y, start, self.from(y, edges));
        }
    }

    /// Even nodes send left, right and down; then odd nodes send down. The last row sends nothing down.
    fn forward_row(&self, y: usize, start: Start, edges: &mut [u8]) {
        let (even, odd) = planes(y);
        let last = y + 1 == self.end;
        if start != Start::Held {
            self.pass.refine(even, &[Side::Left, Side::Right], edges);
            if !last || start == Start::Refined {
                self.pass.refine(even, &[Side::Down], edges);
            }
            if last && start == Start::Refined {
                self.pass.refine(odd, &[Side::Down], edges);
            }
        }
        self.pass.send(Way::Down, even, if last { Sends::Sides } else { Sends::SidesAndOn }, edges);
        if !last {
            self.pass.send(Way::Down, odd, Sends::On, edges);
        }
    }

    /// Passes up these rows.
    fn backward(&self, rows: Range<usize>, edges: &mut [u8]) {
        for y in rows.rev() {
            self.backward_row(y, self.from(y, edges));
        }
    }

    /// Odd nodes send left, right and up; then even nodes send up. The first row sends nothing up.
    fn backward_row(&self, y: usize, edges: &mut [u8]) {
        let (even, odd) = planes(y);
        let first = y == self.first;
        self.pass.send(Way::Up, odd, if first { Sends::Sides } else { Sends::SidesAndOn }, edges);
        if !first {
            self.pass.send(Way::Up, even, Sends::On, edges);
        }
    }
}

/// The messages that a pass down starts with.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Start {
    /// Those that the edges hold.
    Held,
    /// The first messages of all rows.
    Refined,
    /// The first messages of all rows. The last row holds those from below already, which came across a seam.
    RefinedAboveSeam,
}

/// The even and the odd nodes of row y.
fn planes(y: usize) -> (PlaneRow, PlaneRow) {
    (PlaneRow { plane: y % 2, y }, PlaneRow { plane: 1 - y % 2, y })
}
