//! The state of the oracle between two kernels, and the message as defined.

use bp_core::{LabelSet, Node, Plan, Side, Smoothness};

/// The data cost of a label that a node's set lacks.
const IMPOSSIBLE: i64 = 1 << 40;

type Messages = Vec<[Vec<i64>; 4]>;

/// The values of one grid: greys `[node]`, sums of data costs and the costs made from them `[node][label]`, and
/// received messages `[node][side][label]`.
pub(super) struct Grid {
    pub(super) greys: Vec<i64>,
    pub(super) sums: Vec<Vec<i64>>,
    pub(super) costs: Vec<Vec<i64>>,
    pub(super) received: Messages,
    /// The label sets of all nodes, as they are used at present.
    pub(super) sets: Vec<LabelSet>,
    /// The labels of all nodes, if they are decided.
    pub(super) decided: Vec<u16>,
}

/// The values of all grids of a plan.
pub(super) struct State {
    pub(super) plan: Plan,
    pub(super) grids: Vec<Grid>,
    /// The labels that were decided for the rows above seams, `[height][width]` of any grid.
    pub(super) above_seams: Vec<u16>,
}

impl State {
    /// Zeros everywhere.
    pub(super) fn new(plan: &Plan) -> Self {
        let grid = |grid: usize| Grid {
            greys: vec![0; plan.size(grid).pixels()],
            sums: vec![vec![0; plan.model().labels()]; plan.size(grid).pixels()],
            costs: vec![vec![0; plan.model().labels()]; plan.size(grid).pixels()],
            received: vec![
                [const { Vec::new() }; 4].map(|_: Vec<i64>| vec![0; plan.model().labels()]);
                plan.size(grid).pixels()
            ],
            sets: vec![LabelSet::all(plan.model().labels()); plan.size(grid).pixels()],
            decided: vec![0; plan.size(grid).pixels()],
        };
        let above_seams = vec![0; plan.image_size().pixels()];
        Self { grids: (0..plan.grids()).map(grid).collect(), above_seams, plan: plan.clone() }
    }

    /// The index of a node in the lists of its grid.
    pub(super) fn index(&self, grid: usize, node: Node) -> usize {
        self.plan.size(grid).index(node)
    }

    /// Computes the costs of a grid from its sums.
    pub(super) fn set_costs(&mut self, grid: usize) {
        let clips = grid > 0 && self.plan.settings().coarse_clip;
        let truncation = i64::from(self.plan.model().truncation());
        let Grid { sums, costs, sets, .. } = &mut self.grids[grid];
        costs.clone_from(sums);
        for (costs, set) in costs.iter_mut().zip(sets) {
            let least = set.labels().map(|label| costs[label]).min().unwrap_or(0);
            costs
                .iter_mut()
                .filter(|_| clips)
                .for_each(|cost| *cost = (*cost - least).min(truncation + truncation / 2));
            (0..costs.len()).filter(|&label| !set.contains(label)).for_each(|label| costs[label] = IMPOSSIBLE);
        }
    }

    /// The smoothness cost of labels a and d at the ends of the edge from `node` to that side.
    pub(super) fn smoothness(&self, grid: usize, node: Node, side: Side) -> impl Fn(usize, usize) -> i64 + use<> {
        let grey = |node| self.grids[grid].greys[self.index(grid, node)];
        let difference = self.plan.neighbour(grid, node, side).map_or(0, |other| grey(node) - grey(other)).abs();
        let edges = self.plan.model().edges();
        let level = edges.most().into_iter().position(|most| difference <= most.into()).unwrap_or(0);
        let Smoothness { slope, truncation } = edges.smoothness()[level];
        let (slope, truncation) = (i64::from(slope), i64::from(truncation));
        move |a, d| (slope * a.abs_diff(d) as i64).min(truncation)
    }

    /// The message that the node `from` sends to the side `to`, given the messages it `received`. It uses all but the
    /// one from that side.
    pub(super) fn message(&self, grid: usize, from: Node, received: &[Vec<i64>; 4], to: Side) -> Vec<i64> {
        let costs = &self.grids[grid].costs[self.index(grid, from)];
        let smoothness = self.smoothness(grid, from, to);
        let sources = || Side::ALL.into_iter().filter(|&side| side != to);
        let h: Vec<i64> = (0..costs.len())
            .map(|a| costs[a] + sources().map(|side| received[side as usize][a]).sum::<i64>())
            .collect();
        let offer = |a: usize, d: usize| h[a] + smoothness(a, d);
        let message: Vec<i64> = (0..h.len()).map(|d| (0..h.len()).map(|a| offer(a, d)).min().unwrap_or(0)).collect();
        let least = message.iter().copied().min().unwrap_or(0);
        message.into_iter().map(|value| value - least).collect()
    }
}
