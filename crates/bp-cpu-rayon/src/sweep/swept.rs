//! The state of the schedule `sweep` from grid to grid: the messages of the coarser grid, the seams, and labels.

use std::sync::{
    PoisonError,
    atomic::{AtomicU64, Ordering},
};

use bp_core::{Error, Plan, Schedule, Side, memory};
use fearless_simd::Level;
use rayon::prelude::*;

use super::{
    Band, CostSource, Sweep, Windows,
    pass::gaps,
    refine::Coarser,
    room::{Entries, band_rows, decided, most_entries},
    seams::{self, Prepared, Seams},
};
use crate::layout::Layout;

/// What is kept of swept grids.
#[derive(Default)]
pub(crate) struct Swept {
    windows: Windows,
    seams: Vec<Seams>,
    /// The bands of grids of even index from 2 on and of odd index: only a grid and the next coarser one are needed at the
    /// same time.
    bands: [Vec<Band>; 2],
    /// The labels of all grids where they are decided, from the finest one on.
    labels: Vec<Vec<u16>>,
    /// The message entries computed so far in a solve.
    updates: AtomicU64,
}

/// A grid that is swept.
pub(crate) struct Grid<'a> {
    pub(crate) level: Level,
    pub(crate) plan: &'a Plan,
    pub(crate) index: usize,
    pub(crate) layouts: &'a [Layout],
    pub(crate) costs: CostSource<'a>,
}

/// The grids from `first` on whose bands are the largest of those of even and of odd index that keep any, under `sweep`.
fn kept(plan: &Plan, first: usize) -> impl Iterator<Item = usize> + use<> {
    let swept = plan.settings().schedule == Schedule::Sweep;
    let grids = plan.grids();
    [first, first + 1].into_iter().filter(move |&grid| swept && grid < grids)
}

/// A seam that no band uses.
fn prepared(seam: &mut Seams) -> &mut Prepared {
    seam.get_mut().unwrap_or_else(PoisonError::into_inner)
}

impl Swept {
    /// Allocates everything, except for what label sets make shorter.
    pub(crate) fn new(plan: &Plan) -> Result<Self, Error> {
        let base = plan.finest_with_all_labels();
        let mut bands: [Vec<Band>; 2] = [Vec::new(), Vec::new()];
        for grid in kept(plan, base.max(1)) {
            let [patches, entries] = most_entries(plan, grid);
            let band = |rows| Band::new(rows, patches, entries);
            // In parallel, because most of the time is the system's, to hand out memory.
            let rows: Vec<_> = band_rows(plan, grid).collect();
            bands[grid % 2] = rows.into_par_iter().map(band).collect::<Result<_, _>>()?;
        }
        for grid in kept(plan, 1) {
            bands[grid % 2].resize_with(band_rows(plan, grid).count(), Band::default);
        }
        let mut windows = Windows::new(plan);
        let mut seams = seams::prepared(plan)?;
        let [patches, entries] = most_entries(plan, base);
        windows.fit(plan, patches, entries)?;
        seams.iter_mut().map(prepared).try_for_each(|seam| seam.fit(patches, entries))?;
        let labels = decided(plan).map(|labels| memory::filled("labels", labels, 0)).collect::<Result<_, _>>()?;
        Ok(Self { windows, seams, bands, labels, updates: AtomicU64::new(0) })
    }

    /// Checks that sweeping a grid takes no more than `room` bytes in all, if it has label sets, which are known by now.
    pub(crate) fn check_room(&self, grid: &Grid<'_>, room: u64) -> Result<(), Error> {
        let Grid { plan, index, .. } = *grid;
        if !plan.has_label_sets(index) {
            return Ok(());
        }
        let entries = Entries::count(plan, index, &self.labels[index + 1]);
        let bands = if index > 0 { entries.band_bytes(plan, index, &self.bands[index % 2]) } else { 0 };
        let held = self.bands[1 - index % 2].iter().map(Band::bytes);
        let labels = self.labels.iter().map(memory::bytes);
        let needed = held.chain(labels).chain([bands, entries.shared_bytes(plan)]).fold(0, u64::saturating_add);
        if needed <= room {
            return Ok(());
        }
        Err(Error::OutOfMemory { what: "label sets", needed, available: Some(room) })
    }

    /// Runs all loops on a grid. Keeps the messages of grids from 1 on, and decides labels where they are needed.
    pub(crate) fn run(&mut self, grid: &Grid<'_>) -> Result<(), Error> {
        if grid.index + 1 == grid.plan.grids() {
            self.updates.store(0, Ordering::Relaxed);
        }
        self.seams.iter_mut().for_each(|seam| prepared(seam).grid = None);
        let mut bands = if grid.index > 0 { std::mem::take(&mut self.bands[grid.index % 2]) } else { Vec::new() };
        let mut labels = self.labels.get_mut(grid.index).map(std::mem::take).unwrap_or_default();
        let sweep = self.sweep(grid);
        let result = match grid.index {
            0 => sweep.decode(&self.seams, &mut labels),
            _ => sweep.keep(&self.seams, &mut bands, &mut labels),
        };
        if grid.index > 0 {
            self.bands[grid.index % 2] = bands;
        }
        if let Some(kept) = self.labels.get_mut(grid.index) {
            *kept = labels;
        }
        let [patches, _] = most_entries(grid.plan, 0);
        result.and(self.windows.even_out(grid.plan, patches))
    }

    fn sweep<'a>(&'a self, grid: &'a Grid<'a>) -> Sweep<'a> {
        let Grid { level, plan, index, layouts, costs } = grid;
        let edges = plan.model().edges();
        let coarser = layouts.get(index + 1);
        let cut = plan.settings().cut.map(|cut| cut.x);
        Sweep {
            level: *level,
            plan,
            grid: *index,
            layout: &layouts[*index],
            costs,
            coarser: coarser.map(|layout| Coarser { layout, bands: &self.bands[(index + 1) % 2], edges }),
            coarser_labels: self.labels.get(index + 1).map_or(&[], Vec::as_slice),
            windows: &self.windows,
            gaps: gaps(plan.size(*index).width, cut),
            updates: &self.updates,
        }
    }

    /// The message entries that the last solve computed.
    pub(crate) fn updates(&self) -> u64 {
        self.updates.load(Ordering::Relaxed)
    }

    /// Memory for each thread.
    pub(crate) fn windows(&self) -> &Windows {
        &self.windows
    }

    /// The labels of a grid where they are decided.
    pub(crate) fn labels(&self, grid: usize) -> &[u16] {
        self.labels.get(grid).map_or(&[], Vec::as_slice)
    }

    /// Sweeps grid 0 again and copies the messages received from `side`, `[height][width][labels]`.
    pub(crate) fn read_messages(&self, grid: &Grid<'_>, side: Side, messages: &mut [u8]) -> Result<(), Error> {
        self.sweep(grid).read_messages(&self.seams, side, messages)
    }

    /// The bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        let bands: u64 = self.bands.iter().flatten().map(Band::bytes).sum();
        let bytes = |seam: &Seams| seam.read().unwrap_or_else(PoisonError::into_inner).bytes();
        let seams: u64 = self.seams.iter().map(bytes).sum();
        self.windows.bytes() + bands + seams + self.labels.iter().map(memory::bytes).sum::<u64>()
    }
}
