//! The number of message entries that a plan computes.

use std::ops::Range;

use super::Plan;
use crate::{Node, Patch, Schedule, Seam, Side};

impl Plan {
    /// The message entries that one step on a grid computes. A loop computes every directed message, a half-step half of
    /// them, and a loop of [`Schedule::Sweep`] all but those across a seam.
    ///
    /// # Panics
    /// If there is no such grid.
    #[must_use]
    pub fn updates_per_step(&self, grid: usize) -> u64 {
        let edges = self.edges(grid);
        let messages = match self.settings.schedule {
            Schedule::Sync | Schedule::Outward { .. } => 2 * edges,
            Schedule::Checkerboard => edges,
            Schedule::Sweep => {
                let seams = Seam::all(self.sizes[grid].height);
                2 * (edges - seams.map(|seam| self.edges_above(grid, seam.below)).sum::<u64>())
            }
        };
        messages.saturating_mul(self.model.labels() as u64)
    }

    /// The message entries that are computed before the first step on a grid: those that prepare the seams of
    /// [`Schedule::Sweep`], see [`Seam`].
    ///
    /// # Panics
    /// If there is no such grid.
    #[must_use]
    pub fn seam_updates(&self, grid: usize) -> u64 {
        if self.settings.schedule != Schedule::Sweep {
            return 0;
        }
        let cut = u64::from(self.settings.cut.is_some_and(|cut| cut.x > 0));
        let beside = self.sizes[grid].width as u64 - 1 - cut;
        let up = |rows: Range<usize>| rows.map(|y| self.edges_above(grid, y)).sum::<u64>();
        let prepare = |seam: Seam| {
            let back =
                if self.decides_labels(grid) { seam.label_rows().start } else { seam.below }..seam.rows_below().end;
            let rows = (seam.rows().len() + back.len()) as u64;
            rows * beside + up(seam.rows().start + 1..seam.rows().end) + up(back)
        };
        let messages = Seam::all(self.sizes[grid].height).map(prepare).sum::<u64>();
        messages.saturating_mul(self.model.labels() as u64)
    }

    /// The number of edges between row `y` and the row above that exchange messages.
    fn edges_above(&self, grid: usize, y: usize) -> u64 {
        let joined = self.neighbour(grid, Node { x: 0, y }, Side::Up).is_some();
        if joined { self.sizes[grid].width as u64 } else { 0 }
    }

    /// The message entries that the whole plan computes.
    #[must_use]
    pub fn message_updates(&self) -> u64 {
        self.updates_from(0)
    }

    /// The message entries that a solve at half the resolution computes; see [`Plan::halved`].
    #[must_use]
    pub fn halved_updates(&self) -> u64 {
        self.updates_from(self.halved())
    }

    fn updates_from(&self, finest: usize) -> u64 {
        (finest..self.grids()).map(|grid| self.grid_updates(grid)).fold(0, u64::saturating_add)
    }

    /// The message entries that are computed on a grid.
    ///
    /// # Panics
    /// If there is no such grid.
    #[must_use]
    pub fn grid_updates(&self, grid: usize) -> u64 {
        let steps = self.updates_per_step(grid).saturating_mul(self.settings.steps.into());
        steps.saturating_add(self.seam_updates(grid))
    }

    /// The messages that the nodes of a patch of a band send in all loops, on a grid without a cut. Under label sets, a message
    /// has an entry for every label of its sender's set.
    #[must_use]
    pub fn band_messages(&self, grid: usize, patch: &Patch) -> u64 {
        let (rows, columns) = (patch.rows.len() as u64, patch.columns.len() as u64);
        let beside = self.sent_beside(grid, patch, 0) + self.sent_beside(grid, patch, 1);
        let loops = u64::from(self.settings.steps);
        loops * (beside + 2 * (rows - 1) * columns)
    }

    /// The same for a patch of the rows that prepare a seam.
    #[must_use]
    pub fn seam_patch_messages(&self, grid: usize, seam: Seam, patch: &Patch) -> u64 {
        let columns = patch.columns.len() as u64;
        let labelled = if self.decides_labels(grid) { seam.label_rows() } else { seam.below..seam.below };
        let back = Patch { columns: patch.columns.clone(), rows: labelled.start..seam.rows_below().end };
        let beside = self.sent_beside(grid, patch, 0) + self.sent_beside(grid, &back, 1);
        let vertical = (patch.rows.len() as u64 - 1) + back.rows.len() as u64;
        beside + vertical * columns
    }

    /// The messages that the nodes of a patch whose x + y has this parity send left and right.
    fn sent_beside(&self, grid: usize, patch: &Patch, parity: usize) -> u64 {
        let last = self.sizes[grid].width - 1;
        let sent = |y: usize| {
            let sends = |x: usize| (x + y) % 2 == parity;
            let nodes =
                patch.columns.len() / 2 + usize::from(patch.columns.len() % 2 == 1 && sends(patch.columns.start));
            let border = |x: usize| usize::from(patch.columns.contains(&x) && sends(x));
            (2 * nodes - border(0) - border(last)) as u64
        };
        patch.rows.clone().map(sent).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Algorithm, BAND_ROWS, Model, Profile, Settings, Size};

    /// With all labels, the patches of a plan compute what the plan does.
    #[test]
    fn patches_add_up_to_the_plan() {
        for (width, height) in [(1, 1), (1, 70), (131, 97), (64, 33), (200, 32)] {
            let size = Size { width, height };
            let ours = Algorithm::Sweep.settings(size, 1, 1, Schedule::Sweep);
            let settings = Settings { grids: 3, steps: 2, label_sets: true, ..ours };
            let plan = Plan::new(size, Model::new(Profile::Census, 9).unwrap(), settings).unwrap();
            for grid in 0..2 {
                let Size { width, height } = plan.size(grid);
                let bands = (0..height).step_by(BAND_ROWS).map(|first| first..height.min(first + BAND_ROWS));
                let bands = bands.flat_map(|rows| Patch::all(width, rows));
                let bands: u64 = bands.map(|patch| plan.band_messages(grid, &patch)).sum();
                assert_eq!(9 * bands, 2 * plan.updates_per_step(grid), "{size} {grid}");
                let seams = Seam::all(height).flat_map(|seam| Patch::all(width, seam.rows()).map(move |p| (seam, p)));
                let seams: u64 = seams.map(|(seam, patch)| plan.seam_patch_messages(grid, seam, &patch)).sum();
                assert_eq!(9 * seams, plan.seam_updates(grid), "{size} {grid}");
            }
        }
    }
}
