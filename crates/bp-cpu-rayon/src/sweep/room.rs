//! The memory that sweeps need, before label sets are known and after.

use std::ops::Range;

use bp_core::{BAND_ROWS, LabelSet, Patch, Plan, Schedule, Seam};
use rayon::prelude::*;

use super::{Band, made::Made, seams, seams::Prepared, swept::Kept, windows};

/// The patches of a row of a grid, and the most entries that they may have.
pub(super) fn most_entries(plan: &Plan, grid: usize) -> [usize; 2] {
    let patches = Patch::all(plan.size(grid).width, 0..1).len();
    [patches, patches.saturating_mul(plan.model().labels())]
}

/// The rows of the bands of a grid.
pub(super) fn bands(plan: &Plan, grid: usize) -> impl ExactSizeIterator<Item = Range<usize>> + use<> {
    let height = plan.size(grid).height;
    (0..height.div_ceil(BAND_ROWS)).map(move |band| BAND_ROWS * band..height.min(BAND_ROWS * (band + 1)))
}

/// The grids that are swept.
pub(super) fn swept(plan: &Plan) -> Range<usize> {
    if plan.settings().schedule == Schedule::Sweep { 0..plan.grids() } else { 0..0 }
}

/// The bytes that [`Swept`](super::Swept) will hold, if label sets hold this many labels.
pub(crate) fn bytes(plan: &Plan, labels: usize) -> u64 {
    let entries = |grid: usize| {
        let [patches, entries] = most_entries(plan, grid);
        if plan.has_label_sets(grid) { patches.saturating_mul(labels) } else { entries }
    };
    let grids = swept(plan).map(|grid| {
        let [patches, _] = most_entries(plan, grid);
        let bands = bands(plan, grid).map(|rows| Band::needed(plan, grid, rows.len(), patches, entries(grid)));
        let seams = Seam::all(plan.size(grid).height).map(|_| seams::bytes(plan, grid, patches, entries(grid)));
        bands.chain(seams).fold(0, u64::saturating_add)
    });
    let [patches, _] = most_entries(plan, 0);
    let most = (0..plan.grids()).map(entries).max().unwrap_or(0);
    grids.fold(windows::bytes(plan, patches, most), u64::saturating_add)
}

/// The entries of the label sets of a grid.
pub(super) struct Entries {
    /// Those of each band.
    bands: Vec<usize>,
    /// Those of each seam.
    seams: Vec<usize>,
}

impl Entries {
    /// Counts the entries of a grid, whose label sets come from the labels of the next coarser one, `kept`.
    pub(super) fn count(plan: &Plan, grid: usize, kept: &Kept) -> Self {
        let size = plan.size(grid);
        let coarser = plan.size(grid + 1);
        let entries = |rows: Range<usize>| -> usize {
            let sets = Patch::all(size.width, rows).map(|patch| {
                let band = |y: usize| kept.bands[y / BAND_ROWS].get().map_or(&[][..], |band| &band.labels);
                LabelSet::of(plan, grid, &patch, |y| &band(y)[y % BAND_ROWS * coarser.width..])
            });
            sets.map(|set| set.count()).sum()
        };
        let (bands, seams): (Vec<_>, Vec<_>) = (bands(plan, grid).collect(), Seam::all(size.height).collect());
        Self {
            bands: bands.into_par_iter().map(&entries).collect(),
            seams: seams.into_par_iter().map(|seam| entries(seam.rows())).collect(),
        }
    }

    /// The bytes that the grid will hold, given what is held already, and all windows.
    pub(super) fn bytes(&self, plan: &Plan, grid: usize, held: &Kept) -> u64 {
        let [patches, _] = most_entries(plan, grid);
        let bands = bands(plan, grid).zip(&self.bands).zip(&held.bands).map(|((rows, &entries), held)| {
            Band::needed(plan, grid, rows.len(), patches, entries).max(held.with(Band::bytes))
        });
        let seams = self
            .seams
            .iter()
            .zip(&held.seams)
            .map(|(&entries, held)| seams::bytes(plan, grid, patches, entries).max(held.with(Prepared::bytes)));
        // The windows have been used on the grids with all labels.
        let [_, all] = most_entries(plan, plan.finest_with_all_labels());
        let most = self.bands.iter().chain(&self.seams).copied().chain([all]).max().unwrap_or(0);
        let [patches, _] = most_entries(plan, 0);
        bands.chain(seams).fold(windows::bytes(plan, patches, most), u64::saturating_add)
    }
}

/// Makes room for the bands and seams of a grid, unless label sets will tell how much.
pub(super) fn kept(plan: &Plan, grid: usize) -> Result<Kept, bp_core::Error> {
    let [patches, entries] = if plan.has_label_sets(grid) { [0, 0] } else { most_entries(plan, grid) };
    let band = |rows: Range<usize>| Band::new(plan, grid, rows.len(), patches, entries).map(Made::new);
    let seam = |_| {
        let mut prepared = Prepared::new(plan, grid)?;
        prepared.fit(patches, entries)?;
        Ok(Made::new(prepared))
    };
    // In parallel, because most of the time is the system's, to hand out memory.
    let rows: Vec<_> = bands(plan, grid).collect();
    let bands = rows.into_par_iter().map(band).collect::<Result<_, _>>()?;
    Ok(Kept { bands, seams: Seam::all(plan.size(grid).height).map(seam).collect::<Result<_, _>>()? })
}
