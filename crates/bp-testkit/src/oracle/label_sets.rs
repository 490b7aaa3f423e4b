//! Label sets, which follow their definition sentence by sentence.

use std::ops::Range;

use bp_core::{LabelSet, Node, Patch};

use super::state::State;

impl State {
    /// Gives the nodes of rows that are passed together their sets and the costs of these.
    pub(super) fn restrict(&mut self, grid: usize, rows: Range<usize>) {
        if !self.plan.has_label_sets(grid) {
            return;
        }
        for patch in Patch::all(self.plan.size(grid).width, rows) {
            let (decided, width) = (&self.grids[grid + 1].decided, self.plan.size(grid + 1).width);
            let set = LabelSet::of(&self.plan, grid, &patch, |y| &decided[y * width..]);
            for node in patch.nodes() {
                let node = self.index(grid, node);
                self.grids[grid].sets[node] = set;
            }
        }
        self.set_costs(grid);
    }

    /// The values for all labels of a message that `receiver` holds.
    pub(super) fn extended(&self, grid: usize, receiver: Node, message: &[i64]) -> Vec<i64> {
        let model = self.plan.model();
        let (slope, truncation) = (i64::from(model.slope()), i64::from(model.truncation()));
        let set = self.grids[grid].sets[self.index(grid, receiver)];
        let offer = |e: usize, d: usize| (message[e] + slope * e.abs_diff(d) as i64).min(truncation);
        let value = |d: usize| set.labels().map(|e| offer(e, d)).min().unwrap_or(0);
        if set == LabelSet::all(model.labels()) { message.to_vec() } else { (0..message.len()).map(value).collect() }
    }
}
