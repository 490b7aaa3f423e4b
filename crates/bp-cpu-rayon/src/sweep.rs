//! [`bp_core::Schedule::Sweep`]: passes every band of rows by itself, in cache.
//!
//! Values lie in blocks: 32 nodes of one column parity in the 64 columns of a [`bp_core::Patch`], one byte for each node.
//! Every array is `[row][patch][entry]`, where the entries of a patch are the labels of its list ([`lists`]). So walks over
//! the labels are contiguous, and patches may have different labels ([`bp_core::Settings::label_sets`]).
//!
//! `pass` runs over rows; it calls `costs`, `refine` and `send` block by block. `decode` decides labels.

mod costs;
mod crossings;
mod decode;
mod edges;
mod lists;
mod messages;
mod padded;
mod pass;
mod refine;
mod room;
mod routes;
mod seams;
mod send;
mod swept;
mod windows;

use std::{
    ops::Range,
    sync::{
        PoisonError,
        atomic::{AtomicU64, Ordering},
    },
};

use bp_core::{BAND_ROWS, Error, Patch, Plan, Seam, Side};
use fearless_simd::Level;
use rayon::prelude::*;

pub(crate) use costs::CostSource;
pub(crate) use room::bytes;
pub(crate) use swept::{Grid, Swept};
pub(crate) use windows::Windows;

use crate::{
    block::{Block, LANES},
    layout::Layout,
};
use lists::Lists;
use messages::{Entry, Messages};
use pass::{Gap, Pass, Start};
use refine::Coarser;
use seams::{Prepared, Seams};
use windows::{Window, Work};

/// A band of a grid whose messages the next finer grid starts with.
#[derive(Default)]
pub(crate) struct Band {
    lists: Lists,
    messages: Messages,
}

/// The bytes of a band of so many rows, patches and entries.
fn band_bytes(rows: usize, patches: usize, entries: usize) -> u64 {
    lists::bytes(patches, entries).saturating_add(messages::bytes(rows, entries))
}

impl Band {
    /// Allocates room for so many rows, patches and entries.
    fn new(rows: usize, patches: usize, entries: usize) -> Result<Self, Error> {
        let mut band = Self::default();
        band.lists.fit(patches, entries)?;
        band.messages.fit(rows, entries)?;
        Ok(band)
    }

    /// The bytes held.
    fn bytes(&self) -> u64 {
        self.lists.bytes() + self.messages.bytes()
    }
}

/// A grid that is swept.
pub(crate) struct Sweep<'a> {
    level: Level,
    plan: &'a Plan,
    grid: usize,
    layout: &'a Layout,
    costs: &'a CostSource<'a>,
    coarser: Option<Coarser<'a>>,
    /// The labels of the next coarser grid, if they determine label sets.
    coarser_labels: &'a [u16],
    windows: &'a Windows,
    gaps: [Option<Gap>; 4],
    /// The message entries computed so far.
    updates: &'a AtomicU64,
}

impl Sweep<'_> {
    /// Prepares the seams above and below a band, unless another band did. So no thread waits until all seams are prepared.
    fn prepare_seams(&self, band: usize, seams: &[Seams]) -> Result<(), Error> {
        let all = || Seam::all(self.layout.size.height).zip(seams);
        let around = || all().skip(band.saturating_sub(1)).take(1 + band.min(1));
        // First those that no other thread is preparing, which may take as long.
        for (seam, prepared) in around() {
            if let Ok(mut prepared) = prepared.try_write() {
                self.prepare_seam(seam, &mut prepared)?;
            }
        }
        for (seam, prepared) in around() {
            if prepared.read().unwrap_or_else(PoisonError::into_inner).grid != Some(self.grid) {
                self.prepare_seam(seam, &mut prepared.write().unwrap_or_else(PoisonError::into_inner))?;
            }
        }
        Ok(())
    }

    fn prepare_seam(&self, seam: Seam, prepared: &mut Prepared) -> Result<(), Error> {
        if prepared.grid != Some(self.grid) {
            self.windows.with(|window| self.pass_seam(seam, prepared, window))?;
            prepared.grid = Some(self.grid);
        }
        Ok(())
    }

    fn pass_seam(&self, seam: Seam, prepared: &mut Prepared, window: &mut Window) -> Result<(), Error> {
        let Window { messages, work, .. } = window;
        self.fill(seam.rows(), &mut prepared.lists, messages, work)?;
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

    /// Makes the lists of rows that are passed together, and room for everything else.
    fn fill(
        &self,
        rows: Range<usize>,
        lists: &mut Lists,
        messages: &mut Messages,
        work: &mut Work,
    ) -> Result<(), Error> {
        lists.fill(self.plan, self.grid, rows.clone(), self.coarser_labels)?;
        messages.fit(rows.len(), lists.entries())?;
        work.fit(rows.len(), lists.entries())?;
        work.crossings.find(lists, self.plan.model().edges());
        Ok(())
    }

    /// Counts the message entries of rows.
    fn count(&self, lists: &Lists, rows: Range<usize>, updates: impl Fn(&Patch, u64) -> u64) {
        let patches = Patch::all(self.layout.size.width, rows).enumerate();
        let sum = patches.map(|(index, patch)| updates(&patch, lists.range(index).len() as u64)).sum();
        self.updates.fetch_add(sum, Ordering::Relaxed);
    }

    /// Sweeps all bands and keeps their messages. Decides their labels, if `labels` has room for any.
    fn keep(&self, seams: &[Seams], bands: &mut [Band], labels: &mut [u16]) -> Result<(), Error> {
        let band_labels = BAND_ROWS * self.layout.size.width;
        let bands = bands.par_iter_mut().take(self.layout.size.height.div_ceil(BAND_ROWS)).enumerate();
        let sweep = |index: usize, band: &mut Band, labels: Option<&mut [u16]>| {
            self.prepare_seams(index, seams)?;
            self.windows.with(|window| {
                let Band { lists, messages } = band;
                self.sweep(index, seams, (lists, messages, &mut window.work), |pass, above| {
                    if let Some(labels) = labels {
                        pass.decode(pass.rows.clone(), above, labels);
                    }
                })
            })
        };
        if labels.is_empty() {
            bands.try_for_each(|(index, band)| sweep(index, band, None))
        } else {
            let labels = labels.par_chunks_mut(band_labels);
            bands.zip(labels).try_for_each(|((index, band), labels)| sweep(index, band, Some(labels)))
        }
    }

    /// Sweeps all bands and decides their labels.
    fn decode(&self, seams: &[Seams], labels: &mut [u16]) -> Result<(), Error> {
        let bands = labels.par_chunks_mut(BAND_ROWS * self.layout.size.width);
        bands.enumerate().try_for_each(|(index, labels)| {
            self.in_window(index, seams, |pass, above| pass.decode(pass.rows.clone(), above, labels))
        })
    }

    /// Sweeps all bands again and copies the messages received from `side`, `[height][width][labels]`. Labels that the
    /// receiver's set lacks have zeros.
    fn read_messages(&self, seams: &[Seams], side: Side, messages: &mut [u8]) -> Result<(), Error> {
        messages.fill(0);
        let bands = messages.par_chunks_mut(BAND_ROWS * self.layout.size.width * self.layout.labels);
        bands
            .enumerate()
            .try_for_each(|(index, out)| self.in_window(index, seams, |pass, _| pass.read_messages(side, out)))
    }

    fn in_window(
        &self,
        index: usize,
        seams: &[Seams],
        then: impl FnOnce(&Pass<'_>, Option<&[u16]>),
    ) -> Result<(), Error> {
        self.prepare_seams(index, seams)?;
        self.windows.with(|window| {
            let Window { lists, messages, work } = window;
            self.sweep(index, seams, (lists, messages, work), then)
        })
    }

    /// Sweeps a band as often as the plan requires, then calls `then` with it and the labels above it.
    fn sweep(
        &self,
        index: usize,
        seams: &[Seams],
        (lists, messages, work): (&mut Lists, &mut Messages, &mut Work),
        then: impl FnOnce(&Pass<'_>, Option<&[u16]>),
    ) -> Result<(), Error> {
        let (first, height) = (index * BAND_ROWS, self.layout.size.height);
        let rows = first..height.min(first + BAND_ROWS);
        self.fill(rows.clone(), lists, messages, work)?;
        self.count(lists, rows.clone(), |patch, labels| self.plan.band_messages(self.grid, patch) * labels);
        let mut pass = Pass { sweep: self, rows: rows.clone(), lists, messages, work };
        let seam = |index: usize| seams[index].read().unwrap_or_else(PoisonError::into_inner);
        let above = index.checked_sub(1).map(seam);
        match &above {
            Some(seam) => seam.carry(self.plan, 0, lists, pass.up_mut(first)),
            None => pass.up_mut(first).fill(Block::ZERO),
        }
        let mut start = Start::Refined;
        if rows.end < height {
            seam(index).carry(self.plan, 1, lists, pass.up_mut(rows.end));
            start = Start::RefinedAboveSeam;
        }
        for _ in 0..self.plan.settings().steps {
            pass.forward(start);
            pass.backward(rows.clone());
            start = Start::Held;
        }
        then(&pass, above.as_deref().map(|seam| seam.labels_above(self.layout.size.width)));
        Ok(())
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
