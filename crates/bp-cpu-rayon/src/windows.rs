//! Memory for the bands that threads sweep at the same time.

use std::sync::{Mutex, PoisonError};

use bp_core::{BAND_ROWS, Error, Plan, Schedule, memory};

use crate::{edges, match_cost::is_stored, shape::Shape};

/// The memory in which one thread sweeps a band: its messages, and its costs unless those of the grid are stored.
pub(crate) struct Window {
    /// The costs of a band; empty if those of the grid are stored.
    pub(crate) costs: Vec<u8>,
    /// The edges up from the first row, and those inside and down from all rows.
    pub(crate) edges: Vec<u8>,
}

/// A window for every thread that may sweep at the same time.
pub(crate) struct Windows {
    windows: Vec<Mutex<Window>>,
}

/// The number of windows: one for each thread of the pool, but no more than there are bands, and none under other
/// schedules.
fn windows(plan: &Plan) -> usize {
    let bands = plan.image_size().height.div_ceil(BAND_ROWS);
    if plan.settings().schedule == Schedule::Sweep { rayon::current_num_threads().min(bands) } else { 0 }
}

/// The bytes of a window's costs and of its edges.
fn window_bytes(plan: &Plan) -> [usize; 2] {
    let shape = Shape::new(plan, 0);
    let rows = BAND_ROWS.min(shape.size.height);
    let costs = if is_stored(plan, 0) { 0 } else { rows.saturating_mul(shape.row()) };
    [costs, (rows + 1).saturating_mul(edges::row_bytes(&shape))]
}

/// The bytes that [`Windows`] will hold.
pub(crate) fn bytes(plan: &Plan) -> u64 {
    let [costs, edges] = window_bytes(plan).map(|bytes| bytes as u64);
    (windows(plan) as u64).saturating_mul(costs.saturating_add(edges))
}

impl Windows {
    /// Allocates windows for the threads of the current pool.
    pub(crate) fn new(plan: &Plan) -> Result<Self, Error> {
        let [costs, edges] = window_bytes(plan);
        let window = |_| {
            let (costs, edges) = (memory::filled("data cost", costs, 0)?, memory::filled("messages", edges, 0)?);
            Ok(Mutex::new(Window { costs, edges }))
        };
        Ok(Self { windows: (0..windows(plan)).map(window).collect::<Result<_, Error>>()? })
    }

    /// Calls `work` with a free window. A thread waits only if more threads than windows need one at the same time.
    pub(crate) fn with<R>(&self, work: impl FnOnce(&mut Window) -> R) -> R {
        let own = rayon::current_thread_index().unwrap_or(0) % self.windows.len();
        let (before, after) = self.windows.split_at(own);
        let free = after.iter().chain(before).find_map(|window| window.try_lock().ok());
        // A window holds nothing that outlives a band, so a panic in another band does no harm.
        let mut window = free.unwrap_or_else(|| self.windows[own].lock().unwrap_or_else(PoisonError::into_inner));
        work(&mut window)
    }

    /// The bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        let bytes = |window: &Mutex<Window>| {
            let window = window.lock().unwrap_or_else(PoisonError::into_inner);
            memory::bytes(&window.costs) + memory::bytes(&window.edges)
        };
        self.windows.iter().map(bytes).sum()
    }
}
