//! Runs several steps in one pass over the rows of a grid, so that rows stay in cache, on several threads.
//!
//! If steps ran one after another, each would read all rows from memory again:
//!
//! ```text
//! for t in 0..steps:  for y in 0..height:  step(y, t)
//! ```
//!
//! Step t may run on row y as soon as step t - 1 has run on rows y - 1, y and y + 1. So each step follows the previous
//! one, one row behind, and all steps use a row while it is in cache:
//!
//! ```text
//! for front in 0..height + steps:  for t in 0..steps:  step(front - t, t)
//! ```

use std::ops::Range;

use crate::block::Block;

/// Bytes of rows that one thread keeps in cache. Running more steps together needs more rows.
const REACH: usize = 6 << 20;

/// The most steps that run together. More would save nothing.
const MOST_STEPS: usize = 16;

/// The number of steps to run together over rows of so many blocks. Each step needs one more row in cache.
pub(crate) fn fused_steps(row: usize) -> usize {
    (REACH / (row * size_of::<Block>()).max(1)).clamp(1, MOST_STEPS)
}

/// Steps over the rows of a grid. A step on row y reads and writes rows y and y + 1, and needs the step before it to be
/// done on both neighbours of row y.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wavefront {
    /// The number of rows.
    pub(crate) height: usize,
    /// The number of steps.
    pub(crate) steps: usize,
}

impl Wavefront {
    /// Calls `step(rows, y, t)` for every row y and step t, with the rows of each buffer from row y on. Buffers have one
    /// row more than the grid.
    ///
    /// Threads work on slabs of rows. First, each slab runs the steps that need no other slab: with every step, one row
    /// less at each border. Then the gaps between slabs are filled. The number of slabs does not affect the result.
    pub(crate) fn run<const N: usize>(
        self,
        buffers: [Part<'_>; N],
        step: &(impl Fn([&mut [Block]; N], usize, usize) + Sync),
    ) {
        let slab = self.slab();
        let last = (self.height - 1) / slab;
        let mut buffers = buffers;
        let slabs = buffers.each_mut().map(Part::reborrow);
        each_slab(slabs, 0..last + 1, slab, &|rows, index| {
            let (first, end) = (index * slab, (index + 1) * slab);
            let range = |t| {
                let from = if index == 0 { 0 } else { first + t };
                from..if index == last { self.height } else { end - 1 - t }
            };
            self.skewed(rows, first, range, step);
        });
        let gaps = buffers.map(|buffer| buffer.split_at(slab / 2).1);
        each_slab(gaps, 0..last, slab, &|rows, index| {
            let gap = (index + 1) * slab;
            self.skewed(rows, index * slab + slab / 2, |t| gap - 1 - t..(gap + t).min(self.height), step);
        });
    }

    /// The rows of a slab: two slabs for each thread, but enough rows for the gaps at both borders.
    fn slab(self) -> usize {
        let threads = rayon::current_num_threads();
        let slabs = if threads == 1 { 1 } else { 2 * threads };
        self.height.div_ceil(slabs).max(2 * self.steps)
    }

    /// Runs step t on the rows `range(t)`, one row behind step t - 1. `rows` start at row `first`.
    fn skewed<const N: usize>(
        self,
        mut rows: [Part<'_>; N],
        first: usize,
        range: impl Fn(usize) -> Range<usize>,
        step: &impl Fn([&mut [Block]; N], usize, usize),
    ) {
        let (from, to) = (range(0).start.min(range(self.steps - 1).start), range(0).end.max(range(self.steps - 1).end));
        for front in from..to + self.steps {
            for t in 0..self.steps {
                let Some(y) = front.checked_sub(t).filter(|y| range(t).contains(y)) else { continue };
                step(rows.each_mut().map(|chunk| chunk.starting_at(y - first)), y, t);
            }
        }
    }
}

/// Consecutive rows of a buffer.
pub(crate) struct Part<'a> {
    /// The rows.
    pub(crate) rows: &'a mut [Block],
    /// The blocks of one row.
    pub(crate) row: usize,
}

impl<'a> Part<'a> {
    /// Rows of so many blocks, or none.
    pub(crate) fn new(rows: &'a mut [Block], row: usize) -> Self {
        Self { row: if rows.is_empty() { 0 } else { row }, rows }
    }

    fn reborrow(&mut self) -> Part<'_> {
        Part { rows: self.rows, row: self.row }
    }

    fn starting_at(&mut self, index: usize) -> &mut [Block] {
        &mut self.rows[index * self.row..]
    }

    /// Splits off the first `rows` rows.
    fn split_at(self, rows: usize) -> (Self, Self) {
        let (first, second) = self.rows.split_at_mut((rows * self.row).min(self.rows.len()));
        let row = self.row;
        (Self { rows: first, row }, Self { rows: second, row })
    }
}

/// Calls `f(rows, index)` for every slab of `slab` rows, on several threads. The last slab has all remaining rows.
pub(crate) fn each_slab<const N: usize>(
    buffers: [Part<'_>; N],
    slabs: Range<usize>,
    slab: usize,
    f: &(impl Fn([Part<'_>; N], usize) + Sync),
) {
    match slabs.len() {
        0 => {}
        1 => f(buffers, slabs.start),
        several => {
            let middle = slabs.start + several / 2;
            let mut second = [const { None }; N];
            let mut index = 0;
            let first = buffers.map(|buffer| {
                let (first, rest) = buffer.split_at(several / 2 * slab);
                second[index] = Some(rest);
                index += 1;
                first
            });
            let second = second.map(|rest| rest.unwrap_or(Part { rows: &mut [], row: 0 }));
            let halves = (slabs.start..middle, middle..slabs.end);
            rayon::join(|| each_slab(first, halves.0, slab, f), || each_slab(second, halves.1, slab, f));
        }
    }
}
