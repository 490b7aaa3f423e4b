//! What was prepared for each seam of a swept grid; see [`bp_core::Seam`].

use bp_core::{Error, Plan, Schedule, Seam, memory};
use rayon::prelude::*;

use crate::{edges, shape::Shape};

/// What is known of all seams before the bands are swept. Every grid overwrites that of the coarser one.
pub(crate) struct Seams {
    /// For each seam the messages down, then those up.
    messages: Vec<u8>,
    /// For each seam the labels of [`Seam::label_rows`].
    labels: Vec<u16>,
}

/// One seam.
#[derive(Clone, Copy)]
pub(crate) struct Prepared<'a> {
    /// The messages across it from above, by [`edges::up`].
    pub(crate) down: &'a [u8],
    /// The messages across it from below.
    pub(crate) up: &'a [u8],
    /// The labels of the row above it.
    pub(crate) labels: &'a [u16],
}

/// One seam, to be written.
pub(crate) struct PreparedMut<'a> {
    /// See [`Prepared::down`].
    pub(crate) down: &'a mut [u8],
    /// See [`Prepared::up`].
    pub(crate) up: &'a mut [u8],
    /// The labels of the rows above it.
    pub(crate) labels: &'a mut [u16],
}

/// The number of seams of a grid.
fn count(shape: &Shape) -> usize {
    Seam::all(shape.size.height).len()
}

/// The numbers of message bytes and of labels that [`Seams`] holds.
fn lens(plan: &Plan) -> [usize; 2] {
    let shape = Shape::new(plan, 0);
    let seams = if plan.settings().schedule == Schedule::Sweep { count(&shape) } else { 0 };
    [(2 * seams).saturating_mul(edges::up_bytes(&shape)), seams * Seam::LABEL_ROWS * shape.size.width]
}

/// The bytes that [`Seams`] will hold.
pub(crate) fn bytes(plan: &Plan) -> u64 {
    let [messages, labels] = lens(plan).map(|len| len as u64);
    messages + 2 * labels
}

impl Seams {
    /// Allocates room for the seams of the finest grid, which is enough for every grid.
    pub(crate) fn new(plan: &Plan) -> Result<Self, Error> {
        let [messages, labels] = lens(plan);
        Ok(Self { messages: memory::filled("messages", messages, 0)?, labels: memory::filled("labels", labels, 0)? })
    }

    /// Room for nothing.
    pub(crate) fn none() -> Self {
        Self { messages: Vec::new(), labels: Vec::new() }
    }

    /// The seam between band `index` and the next one. `None` if there is no such seam.
    pub(crate) fn get(&self, shape: &Shape, index: usize) -> Option<Prepared<'_>> {
        let (bytes, width) = (edges::up_bytes(shape), shape.size.width);
        let messages = self.messages.chunks_exact(2 * bytes).take(count(shape)).nth(index)?;
        let (down, up) = messages.split_at(bytes);
        let labels = self.labels.chunks_exact(Seam::LABEL_ROWS * width).nth(index)?;
        Some(Prepared { down, up, labels: &labels[labels.len() - width..] })
    }

    /// All seams of a grid, and what threads prepare for them.
    pub(crate) fn all_mut(&mut self, shape: &Shape) -> impl ParallelIterator<Item = (Seam, PreparedMut<'_>)> {
        let (bytes, height) = (edges::up_bytes(shape), shape.size.height);
        let messages = self.messages.par_chunks_exact_mut(2 * bytes).take(count(shape));
        let labels = self.labels.par_chunks_exact_mut(Seam::LABEL_ROWS * shape.size.width);
        messages.zip(labels).enumerate().filter_map(move |(index, (messages, labels))| {
            let (down, up) = messages.split_at_mut(bytes);
            Some((Seam::all(height).nth(index)?, PreparedMut { down, up, labels }))
        })
    }

    /// The bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        memory::bytes(&self.messages) + memory::bytes(&self.labels)
    }
}
