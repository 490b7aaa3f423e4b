//! The data costs of one grid.

use bp_core::{Error, IsStopped, LabelSet, Plan, memory};

use crate::sums::{self, Sums};

/// Data costs `[node][label]`, normalised by each node's least cost and clipped at [`Plan::clip`]. It also keeps the
/// unclipped costs if the next coarser grid needs them for its sums.
pub(crate) struct Costs {
    labels: usize,
    clip: u64,
    stored: Vec<u8>,
    sums: Option<Sums>,
}

impl Costs {
    /// Allocates room for the costs of `grid`.
    pub(crate) fn new(plan: &Plan, grid: usize, is_stopped: IsStopped<'_>) -> Result<Self, Error> {
        Ok(Self {
            labels: plan.model().labels(),
            clip: plan.clip(grid).into(),
            stored: memory::filled_unless(is_stopped, "data cost", plan.volume(grid), 0)?,
            sums: plan.keeps_sums(grid).then(|| Sums::new(plan, grid, is_stopped)).transpose()?,
        })
    }

    /// The costs of all labels of one node.
    pub(crate) fn of(&self, node: usize) -> &[u8] {
        &self.stored[node * self.labels..][..self.labels]
    }

    /// Stores the costs of one node.
    pub(crate) fn store(&mut self, node: usize, costs: &[u64]) {
        let least = costs.iter().copied().min().unwrap_or(0);
        let stored = &mut self.stored[node * self.labels..][..self.labels];
        for (stored, cost) in stored.iter_mut().zip(costs) {
            *stored = (cost - least).min(self.clip) as u8;
        }
        if let Some(sums) = &mut self.sums {
            sums.store(node, costs);
        }
    }

    /// Computes the stored costs of one node again, for the labels of its set. Others get 255. `scratch` has room for one
    /// node's labels.
    pub(crate) fn restrict(&mut self, node: usize, set: &LabelSet, scratch: &mut [u64]) {
        scratch.fill(0);
        self.add_unclipped(node, scratch);
        let least = set.labels().map(|label| scratch[label]).min().unwrap_or(0);
        for (label, stored) in self.stored[node * self.labels..][..self.labels].iter_mut().enumerate() {
            let cost = || (scratch[label] - least).min(self.clip) as u8;
            *stored = if set.contains(label) { cost() } else { u8::MAX };
        }
    }

    /// Adds the unclipped costs of one node to `costs`. If there are no sums, the stored costs were never clipped.
    pub(crate) fn add_unclipped(&self, node: usize, costs: &mut [u64]) {
        match &self.sums {
            Some(sums) => sums.add_to(node, costs),
            None => sums::add(self.of(node), costs),
        }
    }

    /// The bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        memory::bytes(&self.stored) + self.sums.as_ref().map_or(0, Sums::bytes)
    }
}

#[cfg(test)]
mod tests {
    use bp_core::{Algorithm, Model, Profile, Schedule, Size, never};

    use super::*;

    /// The stored costs decide all labels and messages, so those do not change either.
    #[test]
    fn a_constant_added_to_a_nodes_costs_changes_nothing() {
        let size = Size { width: 2, height: 1 };
        let settings = Algorithm::Bp.settings(size, 1, 1, Schedule::Sync);
        let plan = Plan::new(size, Model::new(Profile::Mrf, 4).unwrap(), settings).unwrap();
        let mut costs = Costs::new(&plan, 0, &never).unwrap();
        costs.store(0, &[7, 500, 9, 168]);
        costs.store(1, &[7, 500, 9, 168].map(|cost| cost + 1_000_000));
        assert_eq!(costs.of(0), [0, 161, 2, 161]);
        assert_eq!(costs.of(1), costs.of(0));
    }
}
