//! What is kept of a swept grid: its bands and seams.

use bp_core::{Error, Plan};
use rayon::prelude::*;

use super::{Band, room::most_entries, seams::Prepared, slots::Slots};

/// The bands and seams of a grid.
pub(super) struct Kept {
    pub(super) bands: Slots<Band>,
    pub(super) seams: Slots<Prepared>,
}

impl Kept {
    /// Makes room for so many of them at a time, unless label sets will tell how much.
    pub(super) fn new(plan: &Plan, grid: usize, [bands, seams]: [usize; 2]) -> Result<Self, Error> {
        let [patches, entries] = if plan.has_label_sets(grid) { [0, 0] } else { most_entries(plan, grid) };
        let band = |_| Band::new(plan, grid, patches, entries);
        let seam = |_| {
            let mut prepared = Prepared::new(plan, grid)?;
            prepared.fit(patches, entries)?;
            Ok(prepared)
        };
        // In parallel, because most of the time is the system's, to hand out memory.
        let bands = (0..bands).into_par_iter().map(band).collect::<Result<_, _>>()?;
        Ok(Self { bands: Slots::new(bands), seams: Slots::new((0..seams).map(seam).collect::<Result<_, _>>()?) })
    }

    /// Forgets them, but keeps their memory.
    pub(super) fn forget(&mut self) {
        self.bands.forget();
        self.seams.forget();
    }

    /// Wakes everyone who waits for one: a task failed.
    pub(super) fn fail(&self) {
        self.bands.fail();
        self.seams.fail();
    }

    /// The bytes held.
    pub(super) fn bytes(&self) -> u64 {
        self.bands.sum(Band::bytes) + self.seams.sum(Prepared::bytes)
    }
}
