//! The same model computed the obvious way: in wide integers, with messages by their definition, and clipped only where
//! the definition says so.

mod label_sets;
mod state;
mod sweep;

use std::ops::Range;

use bp_core::{DataCost, Device, Error, IsStopped, MessageStart, Node, Plan, Schedule, Seed, Side, Solver, StereoPair};
use state::{Grid, State};

/// A device that computes in `i64` and takes O(L^2) time for a message. It neither normalises nor clips data costs,
/// except under [`Settings::coarse_clip`](bp_core::Settings::coarse_clip).
#[derive(Clone, Copy, Debug, Default)]
pub struct Oracle;

impl Device for Oracle {
    fn prepare(&self, plan: &Plan, _: IsStopped<'_>) -> Result<Box<dyn Solver>, Error> {
        Ok(Box::new(State::new(plan)))
    }
}

impl State {
    /// Runs one step that reads only messages from before it. Under `checkerboard` that equals an update in place,
    /// because the nodes that send receive nothing in that half-step.
    fn step(&mut self, grid: usize, step: u32) {
        let before = self.grids[grid].received.clone();
        for node in self.plan.size(grid).nodes() {
            let checkerboard = self.plan.settings().schedule == Schedule::Checkerboard;
            if checkerboard && node.is_even() != step.is_multiple_of(2) {
                continue;
            }
            for to in Side::ALL {
                if let Some(receiver) = self.plan.neighbour(grid, node, to) {
                    let message = self.message(grid, node, &before[self.index(grid, node)], to);
                    let receiver = self.index(grid, receiver);
                    self.grids[grid].received[receiver][to.opposite() as usize] = message;
                }
            }
        }
    }

    /// Runs a loop in which nodes send one after another, in the order of their distance from the start node.
    fn pass_outward(&mut self, grid: usize, start: Node) {
        let mut nodes: Vec<Node> = self.plan.size(grid).nodes().collect();
        nodes.sort_by_key(|node| node.x.abs_diff(start.x) + node.y.abs_diff(start.y));
        for node in nodes {
            let received = self.grids[grid].received[self.index(grid, node)].clone();
            for to in Side::ALL {
                let Some(receiver) = self.plan.neighbour(grid, node, to) else { continue };
                let message = self.message(grid, node, &received, to);
                let receiver = self.index(grid, receiver);
                self.grids[grid].received[receiver][to.opposite() as usize] = message;
            }
        }
    }

    /// The first message that a fine node holds from `side`.
    fn first_message(&self, grid: usize, node: Node, side: Side) -> Option<Vec<i64>> {
        let coarse = self.grids.get(grid + 1)?;
        let sender = self.plan.neighbour(grid, node, side)?;
        if self.plan.settings().schedule == Schedule::Sweep {
            return self.first_sweep_message(grid, node, side);
        }
        let receiver = match self.plan.settings().message_start {
            MessageStart::Receiver => node.parent(),
            MessageStart::Sender => self.plan.neighbour(grid + 1, sender.parent(), side.opposite())?,
        };
        Some(coarse.received[self.index(grid + 1, receiver)][side as usize].clone())
    }
}

impl Solver for State {
    fn match_cost(&mut self, pair: &StereoPair, seed: Option<Seed>) -> Result<(), Error> {
        let mut data_cost = DataCost::new(pair.size(), *self.plan.model())?;
        data_cost.load(pair, seed.map(|seed| Seed { x: self.plan.margin() + seed.x, ..seed }))?;
        for (i, Node { x, y }) in self.plan.image_size().nodes().enumerate() {
            let column = self.plan.margin() + x;
            self.grids[0].greys[i] = pair.left().grey(column, y).into();
            for (label, cost) in self.grids[0].sums[i].iter_mut().enumerate() {
                *cost = data_cost.at(column, y, label as u16).into();
            }
        }
        self.set_costs(0);
        Ok(())
    }

    fn coarsen(&mut self, grid: usize) -> Result<(), Error> {
        let (fine, coarse) = self.grids.split_at_mut(grid);
        coarse[0].sums.iter_mut().for_each(|sums| sums.fill(0));
        for (node, costs) in self.plan.size(grid - 1).nodes().zip(&fine[grid - 1].sums) {
            let parent = self.plan.size(grid).index(node.parent());
            coarse[0].sums[parent].iter_mut().zip(costs).for_each(|(sum, cost)| *sum += cost);
        }
        self.set_costs(grid);
        let mut children = vec![Vec::new(); self.plan.size(grid).pixels()];
        for (i, node) in self.plan.size(grid - 1).nodes().enumerate() {
            children[self.index(grid, node.parent())].push(self.grids[grid - 1].greys[i]);
        }
        let mean = |of: &Vec<i64>| (of.iter().sum::<i64>() + of.len() as i64 / 2) / of.len() as i64;
        self.grids[grid].greys = children.iter().map(mean).collect();
        Ok(())
    }

    fn refine(&mut self, grid: usize) -> Result<(), Error> {
        for (i, node) in self.plan.size(grid).nodes().enumerate() {
            for side in Side::ALL {
                let zeros = || vec![0; self.plan.model().labels()];
                let message = self.first_message(grid, node, side).unwrap_or_else(zeros);
                self.grids[grid].received[i][side as usize] = message;
            }
        }
        if self.plan.settings().schedule == Schedule::Sweep {
            self.prepare_seams(grid);
        }
        Ok(())
    }

    fn keep_messages(&mut self) -> Result<(), Error> {
        Ok(())
    }

    fn update_messages(&mut self, grid: usize, steps: Range<u32>) -> Result<(), Error> {
        steps.for_each(|step| match self.plan.settings().schedule {
            Schedule::Sync | Schedule::Checkerboard => self.step(grid, step),
            Schedule::Outward { start } => self.pass_outward(grid, start),
            Schedule::Sweep => {
                self.sweep(grid);
                if step + 1 == self.plan.settings().steps {
                    self.forget_downward(grid);
                    if self.plan.decides_labels(grid) {
                        self.decide_labels(grid);
                    }
                }
            }
        });
        Ok(())
    }

    fn select_labels(&mut self, grid: usize, labels: &mut [u16]) -> Result<(), Error> {
        if self.plan.settings().schedule == Schedule::Sweep {
            labels.copy_from_slice(&self.grids[grid].decided);
            return Ok(());
        }
        let Grid { costs, received, .. } = &self.grids[0];
        for (node, label) in labels.iter_mut().enumerate() {
            let belief = |label: &u16| {
                let label = usize::from(*label);
                costs[node][label] + received[node].iter().map(|message| message[label]).sum::<i64>()
            };
            *label = (0..costs[node].len() as u16).min_by_key(belief).unwrap_or(0);
        }
        Ok(())
    }

    fn read_messages(&mut self, side: Side, messages: &mut [u8]) -> Result<(), Error> {
        let Grid { received, sets, .. } = &self.grids[0];
        let all = received.iter().zip(sets).flat_map(|(received, set)| {
            let values = received[side as usize].iter().enumerate();
            values.map(|(label, &value)| if set.contains(label) { value } else { 0 })
        });
        for (out, message) in messages.iter_mut().zip(all) {
            // A value out of range would disprove `bp_core::exactness`. Show it as a value that no message has.
            *out = u8::try_from(message).unwrap_or(u8::MAX);
        }
        Ok(())
    }

    fn allocated_bytes(&self) -> u64 {
        self.grids.iter().map(|grid| 6 * 8 * (grid.costs.len() * self.plan.model().labels()) as u64).sum()
    }
}
