//! Bytes that the stages of a plan move.

use super::Plan;
use crate::{Schedule, Stage};

impl Plan {
    /// The minimum number of bytes that each stage reads and writes, in the order of [`Stage::ALL`], if every stage
    /// reads its input from memory and writes its output there. Each value counts once per step. `None` under
    /// [`Schedule::Sweep`], whose stages share their input in ways that differ between backends.
    #[must_use]
    pub fn moved_bytes(&self) -> Option<[u64; Stage::ALL.len()]> {
        let (grids, settings, pixels) = (self.grids(), self.settings(), self.image_size().pixels() as u64);
        let costs_of_step = |grid: usize| match settings.schedule {
            Schedule::Sync | Schedule::Outward { .. } => Some(self.volume(grid) as u64),
            Schedule::Checkerboard => Some(self.volume(grid) as u64 / 2),
            Schedule::Sweep => None,
        };
        let images: u64 =
            self.buffers().iter().filter(|buffer| buffer.name == "images").map(|buffer| buffer.bytes).sum();
        let messages = |grid: usize| 2 * self.edges(grid) * self.model().labels() as u64;
        let greys = |grid: usize| self.grey_bytes(grid - 1) + self.grey_bytes(grid);
        let coarsen = |grid: usize| self.summed_bytes(grid - 1) + self.written_bytes(grid) + greys(grid);
        let coarsen = (1..grids).map(coarsen).sum();
        // The coarsest grid starts with zeros, which need no reads.
        let refine =
            (0..grids).map(|grid| messages(grid) + if grid + 1 < grids { messages(grid + 1) } else { 0 }).sum();
        let step = |grid| Some(costs_of_step(grid)? + 2 * self.updates_per_step(grid) + self.grey_bytes(grid));
        let steps = (0..grids).map(step).sum::<Option<u64>>()? * u64::from(settings.steps);
        let select_labels = self.volume(0) as u64 + messages(0) + 2 * pixels;
        Some([images + self.written_bytes(0) + self.grey_bytes(0), coarsen, refine, steps, select_labels])
    }

    /// Bytes that the next coarser grid reads to sum this grid's costs.
    fn summed_bytes(&self, grid: usize) -> u64 {
        let bytes = if self.keeps_sums(grid) { self.sum_bytes(grid) } else { 1 };
        (self.volume(grid) * bytes) as u64
    }

    /// Bytes of a grid's costs, including its sums if it keeps any.
    fn written_bytes(&self, grid: usize) -> u64 {
        let sums = if self.keeps_sums(grid) { self.summed_bytes(grid) } else { 0 };
        self.volume(grid) as u64 + sums
    }
}

#[cfg(test)]
mod tests {
    use crate::{EdgeLevels, Model, Plan, Profile, Schedule, Settings, Size};

    fn moved(schedule: Schedule, grids: u32, steps: u32) -> Option<[u64; 5]> {
        let size = Size { width: 4, height: 2 };
        let settings = crate::Algorithm::Bp.settings(size, 1, 1, schedule);
        let model = Model::new(Profile::Thesis, 3).unwrap();
        Plan::new(size, model, Settings { grids, steps, schedule, ..settings }).unwrap().moved_bytes()
    }

    /// Counted by hand: 4x2 nodes have 10 edges, 2x1 nodes have 1. Each node and each message has 3 labels.
    #[test]
    fn every_value_of_a_step_is_counted_once() {
        let [images, costs, messages, labels] = [2 * 8, 8 * 3, 2 * 10 * 3, 2 * 8];
        let select_labels = costs + messages + labels;
        let sync = [images + costs, 0, messages, 5 * (costs + 2 * messages), select_labels];
        assert_eq!(moved(Schedule::Sync, 1, 5), Some(sync));
        let checkerboard = [images + costs, 0, messages, 5 * (costs / 2 + messages), select_labels];
        assert_eq!(moved(Schedule::Checkerboard, 1, 5), Some(checkerboard));
        let (coarse_costs, coarse_messages) = (2 * 3, 2 * 3);
        let steps = costs + 2 * messages + coarse_costs + 2 * coarse_messages;
        let refine = messages + 2 * coarse_messages;
        assert_eq!(
            moved(Schedule::Sync, 2, 1),
            Some([images + costs, costs + coarse_costs, refine, steps, select_labels])
        );
        assert_eq!(moved(Schedule::Sweep, 1, 1), None);
    }

    /// Counted by hand: each node's grey value is written once, read by the coarser grid, and read in every step.
    #[test]
    fn edge_levels_cost_a_byte_a_node() {
        let size = Size { width: 4, height: 2 };
        let settings = crate::Algorithm::Bp.settings(size, 1, 1, Schedule::Sync);
        let model = Model::new(Profile::Thesis, 3).unwrap();
        let plan = |edges: EdgeLevels| {
            let model = model.with_edges(edges);
            Plan::new(size, model, Settings { grids: 2, steps: 3, ..settings }).unwrap()
        };
        let usual = model.smoothness();
        let (with, without) = (plan(EdgeLevels::halved_above(10, usual)), plan(EdgeLevels::uniform(usual)));
        let moved = with.moved_bytes().unwrap().into_iter().zip(without.moved_bytes().unwrap());
        assert_eq!(moved.map(|(with, without)| with - without).collect::<Vec<_>>(), [8, 8 + 2, 0, 3 * (8 + 2), 0]);
        assert_eq!(with.bytes() - without.bytes(), 8 + 2);
    }
}
