//! [`bp_core::Schedule::Sweep`]: every band of rows by itself, in cache.

use std::sync::{Mutex, PoisonError};

use bp_core::{BAND_ROWS, Error, Plan, Schedule, Side, memory};
use fearless_simd::Level;
use rayon::prelude::*;

use crate::{
    edges::{self, Edges, Rows},
    layout::{Layout, Shape},
    match_cost::Matching,
    refine::Coarser,
    select_labels::Answer,
    solver::{Grid, Way, is_stored},
    update_messages::Sends,
};

/// What one thread needs to sweep a band: room for its costs and messages, which are used up there. Those of the image
/// are never stored as a whole.
pub(crate) struct Window {
    /// Costs of the rows of a band, where those of the grid are not stored.
    pub(crate) costs: Vec<u8>,
    /// The edges up from the first row, and those inside and down from all.
    edges: Vec<u8>,
}

/// Windows for the threads that may sweep at once.
pub(crate) struct Windows {
    windows: Vec<Mutex<Window>>,
}

/// How many windows are held: one for each thread of the pool, but no more than there are bands, and none where nothing
/// is swept.
fn windows(plan: &Plan) -> usize {
    let bands = plan.image_size().height.div_ceil(BAND_ROWS);
    if plan.settings().schedule == Schedule::Sweep { rayon::current_num_threads().min(bands) } else { 0 }
}

/// Bytes of costs and of edges of a window.
fn window_bytes(plan: &Plan) -> [usize; 2] {
    let shape = Shape::new(plan, 0);
    let rows = BAND_ROWS.min(shape.size.height);
    let costs = if is_stored(plan, 0) { 0 } else { rows.saturating_mul(shape.row()) };
    [costs, (rows + 1).saturating_mul(edges::row_bytes(&shape))]
}

/// Bytes that [`Windows`] hold, predicted.
pub(crate) fn bytes(plan: &Plan) -> u64 {
    let [costs, edges] = window_bytes(plan).map(|bytes| bytes as u64);
    (windows(plan) as u64).saturating_mul(costs.saturating_add(edges))
}

impl Windows {
    /// Room for the threads of the pool that this is called in.
    pub(crate) fn new(plan: &Plan) -> Result<Self, Error> {
        let [costs, edges] = window_bytes(plan);
        let window = |_| {
            let (costs, edges) = (memory::filled("data cost", costs, 0)?, memory::filled("messages", edges, 0)?);
            Ok(Mutex::new(Window { costs, edges }))
        };
        Ok(Self { windows: (0..windows(plan)).map(window).collect::<Result<_, Error>>()? })
    }

    /// Works in a free window. Only in a larger pool than the plan was prepared in can there be none, and a thread waits.
    pub(crate) fn with<R>(&self, work: impl FnOnce(&mut Window) -> R) -> R {
        let own = rayon::current_thread_index().unwrap_or(0) % self.windows.len();
        let (before, after) = self.windows.split_at(own);
        let free = after.iter().chain(before).find_map(|window| window.try_lock().ok());
        // A window holds nothing that outlives a band, so that a panic in another band did it no harm.
        let mut window = free.unwrap_or_else(|| self.windows[own].lock().unwrap_or_else(PoisonError::into_inner));
        work(&mut window)
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        let bytes = |window: &Mutex<Window>| {
            let window = window.lock().unwrap_or_else(PoisonError::into_inner);
            memory::bytes(&window.costs) + memory::bytes(&window.edges)
        };
        self.windows.iter().map(bytes).sum()
    }
}

/// Where the costs of a grid come from.
pub(crate) enum CostSource<'a> {
    /// They are stored.
    Stored(&'a [u8]),
    /// They are computed, as often as needed: that takes less time than to fetch them from memory.
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

    /// Sweeps all bands again to tell what every node received from `side`, `[height][width][labels]`.
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

    /// Sweeps a band as often as the plan says, then calls `then` with its costs and edges, row by row.
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
                grid: Grid { level, plan, layout, first, costs, coarser, keeps_messages: false },
                first,
                last: end - 1,
            };
            (0..plan.settings().steps).for_each(|step| band.pass(step == 0, edges));
            then(costs, edges)
        })
    }
}

/// One band.
struct Band<'a> {
    grid: Grid<'a>,
    first: usize,
    last: usize,
}

impl Band<'_> {
    /// One loop. Nothing comes from above the band; from below come the first messages.
    fn pass(&self, first_loop: bool, rows: &mut [u8]) {
        let row_bytes = edges::row_bytes(self.grid.layout);
        for plane in 0..2 {
            edges::slots(self.grid.layout, rows, plane)[2].fill(0);
        }
        for y in self.first..=self.last {
            self.forward(y, first_loop, &mut rows[(y - self.first) * row_bytes..]);
        }
        for y in (self.first..=self.last).rev() {
            self.backward(y, &mut rows[(y - self.first) * row_bytes..]);
        }
    }

    /// Even nodes send to both sides and down, then odd ones down; the last row sends nothing down.
    fn forward(&self, y: usize, first_loop: bool, rows: &mut [u8]) {
        let (even, odd, last) = (y % 2, 1 - y % 2, y == self.last);
        if first_loop {
            self.grid.refine((even, y), &[Side::Left, Side::Right, Side::Down], rows);
            if last {
                self.grid.refine((odd, y), &[Side::Down], rows);
            }
        }
        self.grid.send(Way::Down, (even, y), if last { Sends::Sides } else { Sends::SidesAndOn }, rows);
        if !last {
            self.grid.send(Way::Down, (odd, y), Sends::On, rows);
        }
    }

    /// Odd nodes send to both sides and up, then even ones up; the first row sends nothing up.
    fn backward(&self, y: usize, rows: &mut [u8]) {
        let (even, odd, first) = (y % 2, 1 - y % 2, y == self.first);
        self.grid.send(Way::Up, (odd, y), if first { Sends::Sides } else { Sends::SidesAndOn }, rows);
        if !first {
            self.grid.send(Way::Up, (even, y), Sends::On, rows);
        }
    }
}
