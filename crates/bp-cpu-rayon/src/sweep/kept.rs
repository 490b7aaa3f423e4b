//! What is kept of a swept grid: its bands and seams.

use std::ops::Range;

use bp_core::{Error, Plan, Seam};
use rayon::prelude::*;

use super::{
    Band,
    made::Made,
    room::{bands, most_entries},
    seams::Prepared,
};

/// The bands and seams of a grid.
pub(super) struct Kept {
    pub(super) bands: Vec<Made<Band>>,
    pub(super) seams: Vec<Made<Prepared>>,
}

impl Kept {
    /// Makes room for them, unless label sets will tell how much.
    pub(super) fn new(plan: &Plan, grid: usize) -> Result<Self, Error> {
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
        Ok(Self { bands, seams: Seam::all(plan.size(grid).height).map(seam).collect::<Result<_, _>>()? })
    }

    /// Forgets them, but keeps their memory.
    pub(super) fn forget(&mut self) {
        self.bands.iter_mut().for_each(Made::forget);
        self.seams.iter_mut().for_each(Made::forget);
    }

    /// The bytes held.
    pub(super) fn bytes(&self) -> u64 {
        let bands: u64 = self.bands.iter().map(|band| band.with(Band::bytes)).sum();
        bands + self.seams.iter().map(|seam| seam.with(Prepared::bytes)).sum::<u64>()
    }
}
