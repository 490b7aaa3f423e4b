//! [`bp_core::Schedule::Sweep`]: passes every band of rows by itself, in cache.
//!
//! Values lie in blocks: 32 nodes of one column parity in the 64 columns of a [`bp_core::Patch`], one byte for each node.
//! Every array is `[row][patch][entry]`, where the entries of a patch are the labels of its list ([`lists`]). So walks over
//! the labels are contiguous, and patches may have different labels ([`bp_core::Settings::label_sets`]).
//!
//! `pass` runs over rows; it calls `costs`, `refine` and `send` block by block. `decode` decides labels. `swept` holds what is kept
//! of each grid, and `tasks` says in which order threads work through it.

mod coarser;
mod costs;
mod crossings;
mod decided;
mod decode;
mod edges;
mod kept;
mod lists;
mod messages;
mod padded;
mod pass;
mod refine;
mod room;
mod routes;
mod seams;
mod send;
mod slots;
mod swept;
mod tasks;
mod windows;

use std::{
    ops::Range,
    sync::atomic::{AtomicU64, Ordering},
};

use bp_core::{Error, Patch, Plan, Seam, Side, memory::Buffer};
use fearless_simd::Level;

pub(crate) use costs::CostSource;
pub(crate) use room::bytes;
pub(crate) use swept::{Grid, Swept};
pub(crate) use tasks::Passed;
pub(crate) use windows::Windows;

use crate::{
    block::{Block, LANES},
    layout::Layout,
};
use coarser::Coarser;
use lists::Lists;
use messages::{Entry, Messages};
use pass::{Gap, Pass, Start};
use room::Room;
use seams::Prepared;
use windows::{Window, Work};

/// What is kept of a band.
#[derive(Default)]
pub(crate) struct Band {
    /// The messages that the next finer grid starts with. None on grid 0.
    lists: Lists,
    messages: Messages,
    /// The labels, if any are decided, `[row][width]`.
    labels: Buffer<u16>,
}

impl Band {
    /// Allocates room for so many patches and entries.
    fn new(plan: &Plan, grid: usize, patches: usize, entries: usize) -> Result<Self, Error> {
        let mut band = Self { labels: Buffer::filled("labels", Self::labels(plan, grid), 0)?, ..Self::default() };
        if grid > 0 {
            band.lists.fit(patches, entries)?;
            band.messages.fit(room::most_rows(plan, grid), entries)?;
        }
        Ok(band)
    }

    /// The number of labels.
    fn labels(plan: &Plan, grid: usize) -> usize {
        if plan.decides_labels(grid) { room::most_rows(plan, grid) * plan.size(grid).width } else { 0 }
    }

    /// The bytes that it needs.
    fn needed(plan: &Plan, grid: usize, patches: usize, entries: usize) -> u64 {
        let labels = (Self::labels(plan, grid) * size_of::<u16>()) as u64;
        let rows = room::most_rows(plan, grid);
        let kept = || lists::bytes(patches, entries).saturating_add(messages::bytes(rows, entries));
        labels.saturating_add(if grid > 0 { kept() } else { 0 })
    }

    /// The bytes held.
    fn bytes(&self) -> u64 {
        self.lists.bytes() + self.messages.bytes() + self.labels.bytes()
    }
}

/// The seams above and below a band.
#[derive(Clone, Copy)]
struct Beside<'a> {
    above: Option<&'a Prepared>,
    below: Option<&'a Prepared>,
}

/// A grid that is swept, as rows that are passed together see it.
pub(crate) struct Sweep<'a> {
    level: Level,
    plan: &'a Plan,
    grid: usize,
    layout: &'a Layout,
    costs: &'a CostSource<'a>,
    coarser: Option<Coarser<'a>>,
    gaps: [Option<Gap>; 4],
    room: &'a Room<'a>,
    /// The message entries computed so far.
    updates: &'a AtomicU64,
}

impl Sweep<'_> {
    /// The rows of a band.
    fn band_rows(&self, index: usize) -> Range<usize> {
        tasks::band_rows(self.layout.size.height, index)
    }

    /// Prepares a seam.
    fn pass_seam(&self, seam: Seam, prepared: &mut Prepared, window: &mut Window) -> Result<(), Error> {
        let Window { messages, work, .. } = window;
        let (held, patches) = (prepared.bytes(), Patch::all(self.layout.size.width, seam.rows()).len());
        let kept = |entries| seams::bytes(self.plan, self.grid, patches, entries).saturating_sub(held);
        self.fill(seam.rows(), &mut prepared.lists, messages, work, kept)?;
        self.count(&prepared.lists, seam.rows(), |patch, labels| {
            self.plan.seam_patch_messages(self.grid, seam, patch) * labels
        });
        let entries = prepared.lists.entries();
        prepared.fit_messages(entries)?;
        let [down, up] = &mut prepared.messages;
        let mut pass = Pass { sweep: self, rows: seam.rows(), lists: &prepared.lists, messages, work };
        pass.up_mut(seam.rows().start).fill(Block::ZERO);
        pass.forward(Start::Refined);
        down[..2 * entries].copy_from_slice(pass.up_mut(seam.below));
        pass.backward(seam.rows_below());
        up[..2 * entries].copy_from_slice(pass.up_mut(seam.below));
        if self.plan.decides_labels(self.grid) {
            pass.backward(seam.label_rows());
            let labels = Seam::LABEL_ROWS * self.layout.size.width;
            pass.decode(seam.label_rows(), None, &mut prepared.labels[..labels]);
        }
        Ok(())
    }

    /// Makes the lists of rows that are passed together, and room for everything else. `kept` is by how many bytes what is kept
    /// grows with so many entries.
    fn fill(
        &self,
        rows: Range<usize>,
        lists: &mut Lists,
        messages: &mut Messages,
        work: &mut Work,
        kept: impl FnOnce(usize) -> u64,
    ) -> Result<(), Error> {
        let coarser = |y: usize| self.coarser.map_or(&[][..], |coarser| coarser.labels(y));
        let entries = work.find_sets(self.plan, self.grid, rows.clone(), coarser)?;
        self.room.take(entries, kept(entries))?;
        lists.fill(self.plan.model().edges(), &work.sets)?;
        // The last band may have fewer rows, and take the memory of one that had more.
        messages.fit(room::most_rows(self.plan, self.grid), entries)?;
        work.fit(rows.len(), entries)?;
        work.crossings.find(lists, self.plan.model().edges());
        Ok(())
    }

    /// Counts the message entries of rows.
    fn count(&self, lists: &Lists, rows: Range<usize>, updates: impl Fn(&Patch, u64) -> u64) {
        let patches = Patch::all(self.layout.size.width, rows).enumerate();
        let sum = patches.map(|(index, patch)| updates(&patch, lists.range(index).len() as u64)).sum();
        self.updates.fetch_add(sum, Ordering::Relaxed);
    }

    /// Sweeps a band, then calls `then` with it. Keeps its messages on grids from 1 on, and decides its labels where they are needed.
    fn pass_band(
        &self,
        index: usize,
        beside: Beside<'_>,
        band: &mut Band,
        window: &mut Window,
        then: impl FnOnce(&Pass<'_>),
    ) -> Result<(), Error> {
        let (held, rows) = (band.bytes(), self.band_rows(index));
        let patches = Patch::all(self.layout.size.width, rows.clone()).len();
        let kept = |entries| Band::needed(self.plan, self.grid, patches, entries).saturating_sub(held);
        let Window { lists, messages, work } = window;
        let (lists, messages) = if self.grid > 0 { (&mut band.lists, &mut band.messages) } else { (lists, messages) };
        self.fill(rows.clone(), lists, messages, work, kept)?;
        self.sweep(index, beside, (lists, messages, work), |pass| {
            if !band.labels.is_empty() {
                let above = beside.above.map(|seam| seam.labels_above(self.layout.size.width));
                let labels = &mut band.labels[..rows.len() * self.layout.size.width];
                pass.decode(rows.clone(), above, labels);
            }
            then(pass);
        });
        Ok(())
    }

    /// Sweeps a band, whose lists are filled, as often as the plan requires, then calls `then` with it.
    fn sweep(
        &self,
        index: usize,
        beside: Beside<'_>,
        (lists, messages, work): (&Lists, &mut Messages, &mut Work),
        then: impl FnOnce(&mut Pass<'_>),
    ) {
        let rows = self.band_rows(index);
        self.count(lists, rows.clone(), |patch, labels| self.plan.band_messages(self.grid, patch) * labels);
        let mut pass = Pass { sweep: self, rows: rows.clone(), lists, messages, work };
        match beside.above {
            Some(seam) => seam.carry(self.plan, 0, lists, pass.up_mut(rows.start)),
            None => pass.up_mut(rows.start).fill(Block::ZERO),
        }
        let mut start = Start::Refined;
        if let Some(seam) = beside.below {
            seam.carry(self.plan, 1, lists, pass.up_mut(rows.end));
            start = Start::RefinedAboveSeam;
        }
        for _ in 0..self.plan.settings().steps {
            pass.forward(start);
            pass.backward(rows.clone());
            start = Start::Held;
        }
        then(&mut pass);
    }
}

impl Pass<'_> {
    /// Copies the messages received from `side`, `[row][width][labels]`.
    fn read_messages(&self, side: Side, out: &mut [u8]) {
        let (layout, entries) = (self.sweep.layout, self.lists.entries());
        let rows = out.chunks_exact_mut(layout.size.width * layout.labels).zip(self.rows.clone());
        for (row, out, y) in rows.enumerate().map(|(row, (out, y))| (row, out, y)) {
            for (column, out) in layout.columns().zip(out.chunks_exact_mut(layout.labels)) {
                let node = bp_core::Node { x: column.x, y };
                let went_away = side == Side::Up || side != Side::Down && !node.is_even();
                if went_away || self.sweep.plan.neighbour(self.sweep.grid, node, side).is_none() {
                    continue;
                }
                let (patch, lane) = (column.lane / LANES, column.lane % LANES);
                for (entry, &label) in self.lists.range(patch).zip(self.lists.list(patch).labels) {
                    let at = Entry { row, plane: column.plane, entry, lane };
                    out[usize::from(label)] = self.messages.value(entries, at, side);
                }
            }
        }
    }
}
