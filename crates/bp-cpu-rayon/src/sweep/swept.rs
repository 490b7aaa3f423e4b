//! The state of the schedule `sweep` from grid to grid: the messages of the coarser grid, the seams, and labels.

use std::{
    ops::Range,
    sync::{
        PoisonError,
        atomic::{AtomicU64, Ordering},
    },
};

use bp_core::{BAND_ROWS, Error, LabelSet, Patch, Plan, Schedule, Seam, Side, memory};
use fearless_simd::Level;
use rayon::prelude::*;

use super::{
    Band, CostSource, Sweep, Windows, band_bytes,
    pass::gaps,
    refine::Coarser,
    seams::{self, Prepared, Seams},
    windows,
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

/// The patches of a row of a grid, and the most entries that they may have.
fn most_entries(plan: &Plan, grid: usize) -> [usize; 2] {
    let patches = Patch::all(plan.size(grid).width, 0..1).len();
    [patches, patches.saturating_mul(plan.model().labels())]
}

/// The grids from `first` on whose bands are the largest of those of even and of odd index that keep any, under `sweep`.
fn kept(plan: &Plan, first: usize) -> impl Iterator<Item = usize> + use<> {
    let swept = plan.settings().schedule == Schedule::Sweep;
    let grids = plan.grids();
    [first, first + 1].into_iter().filter(move |&grid| swept && grid < grids)
}

/// The rows of the bands of a grid.
fn band_rows(plan: &Plan, grid: usize) -> impl Iterator<Item = usize> + use<> {
    let height = plan.size(grid).height;
    (0..height).step_by(BAND_ROWS).map(move |first| BAND_ROWS.min(height - first))
}

/// For each grid whose labels are decided and kept, their number.
fn decided(plan: &Plan) -> impl Iterator<Item = usize> + use<'_> {
    let swept = plan.settings().schedule == Schedule::Sweep;
    (0..plan.grids()).filter(move |&grid| swept && plan.decides_labels(grid)).map(|grid| plan.size(grid).pixels())
}

/// The bytes that [`Swept`] will hold, if label sets hold this many labels.
pub(crate) fn bytes(plan: &Plan, labels: usize) -> u64 {
    let entries = |grid: usize| {
        let [patches, entries] = most_entries(plan, grid);
        [patches, if plan.has_label_sets(grid) { patches.saturating_mul(labels) } else { entries }]
    };
    let bands = (1..plan.grids()).map(|grid| {
        let [patches, entries] = entries(grid);
        band_rows(plan, grid).map(|rows| band_bytes(rows, patches, entries)).fold(0, u64::saturating_add)
    });
    // Grids of even and of odd index share memory.
    let mut most = [0; 2];
    bands.zip([1, 0].into_iter().cycle()).for_each(|(bytes, parity)| most[parity] = bytes.max(most[parity]));
    let bands = if plan.settings().schedule == Schedule::Sweep { most } else { [0; 2] };
    let [patches, _] = most_entries(plan, 0);
    let most = (0..plan.grids()).map(|grid| entries(grid)[1]).max().unwrap_or(0);
    let kept = decided(plan).map(|labels| (labels * size_of::<u16>()) as u64);
    let once = [windows::bytes(plan, patches, most), seams::bytes(plan, patches, most)];
    bands.into_iter().chain(kept).chain(once).fold(0, u64::saturating_add)
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

    /// Checks that a grid whose label sets are known needs no more than `room` bytes.
    pub(crate) fn check_room(&self, grid: &Grid<'_>, room: u64) -> Result<(), Error> {
        let Grid { plan, index, .. } = *grid;
        if !plan.has_label_sets(index) {
            return Ok(());
        }
        let size = plan.size(index);
        let coarser = &self.labels[index + 1];
        let entries = |rows: Range<usize>| -> usize {
            Patch::all(size.width, rows).map(|patch| LabelSet::of(plan, index, &patch, coarser).count()).sum()
        };
        let rows = |band: usize| band * BAND_ROWS..size.height.min((band + 1) * BAND_ROWS);
        let bands: Vec<usize> =
            (0..size.height.div_ceil(BAND_ROWS)).into_par_iter().map(|band| entries(rows(band))).collect();
        let seams: Vec<usize> = Seam::all(size.height).map(|seam| entries(seam.rows())).collect();
        let [patches, _] = most_entries(plan, 0);
        let most = bands.iter().chain(&seams).copied().max().unwrap_or(0);
        let kept = self.bands[index % 2].iter().map(Band::bytes).chain(std::iter::repeat(0)).zip(&bands).enumerate();
        let kept = kept.map(|(band, (held, &entries))| held.max(band_bytes(rows(band).len(), patches, entries)));
        let kept: u64 = if index > 0 { kept.sum() } else { 0 };
        let needed = [kept, windows::bytes(plan, patches, most), seams::bytes(plan, patches, most)];
        let held = [&self.bands[1 - index % 2]].into_iter().flatten().map(Band::bytes);
        let labels = self.labels.iter().map(memory::bytes);
        let needed = needed.into_iter().chain(held).chain(labels).fold(0, u64::saturating_add);
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
        let smoothness = plan.model().smoothness();
        let coarser = layouts.get(index + 1);
        let cut = plan.settings().cut.map(|cut| cut.x);
        Sweep {
            level: *level,
            plan,
            grid: *index,
            layout: &layouts[*index],
            costs,
            coarser: coarser.map(|layout| Coarser { layout, bands: &self.bands[(index + 1) % 2], smoothness }),
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

    /// The labels of the image.
    pub(crate) fn labels(&self) -> &[u16] {
        self.labels.first().map_or(&[], Vec::as_slice)
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
