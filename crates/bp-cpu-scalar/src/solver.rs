//! The buffers of one plan, and the kernels that run on them.

use std::ops::Range;

use bp_core::{DataCost, Error, Plan, Seed, Side, Solver, Stage, StereoPair, memory};

use crate::{
    coarsen::coarsen, costs::Costs, greys::Greys, grid::Grid, match_cost::match_cost, messages::Messages,
    refine::refine, select_labels::select_labels, update_messages::update_messages,
};

/// A prepared plan.
pub(crate) struct ScalarSolver {
    plan: Plan,
    data_cost: DataCost,
    costs: Vec<Costs>,
    greys: Vec<Greys>,
    /// The messages of even grids and, if the plan has several grids, of odd ones: only a grid and the next coarser one are
    /// needed at the same time.
    messages: Vec<Messages>,
    scratch: Vec<u64>,
    h: Vec<u8>,
}

impl ScalarSolver {
    /// Allocates all buffers.
    pub(crate) fn new(plan: &Plan) -> Result<Self, Error> {
        let labels = plan.model().labels();
        Ok(Self {
            data_cost: DataCost::new(plan.image_size(), *plan.model())?,
            costs: (0..plan.grids()).map(|grid| Costs::new(plan, grid)).collect::<Result<_, _>>()?,
            greys: (0..plan.grids()).map(|grid| Greys::new(plan, grid)).collect::<Result<_, _>>()?,
            messages: (0..plan.grids().min(2)).map(|grid| Messages::new(plan, grid)).collect::<Result<_, _>>()?,
            scratch: memory::filled("one node's costs", labels, 0)?,
            h: memory::filled("one node's message", labels, 0)?,
            plan: plan.clone(),
        })
    }
}

impl Solver for ScalarSolver {
    fn match_cost(&mut self, pair: &StereoPair, seed: Option<Seed>) -> Result<(), Error> {
        self.data_cost.load(pair, seed)?;
        self.greys[0].load(pair.left());
        match_cost(&self.data_cost, self.plan.image_size(), &mut self.costs[0], &mut self.scratch);
        Ok(())
    }

    fn coarsen(&mut self, grid: usize) -> Result<(), Error> {
        let (fine, coarse) = self.costs.split_at_mut(grid);
        coarsen(&fine[grid - 1], self.plan.size(grid - 1), &mut coarse[0], &mut self.scratch);
        let (fine, coarse) = self.greys.split_at_mut(grid);
        coarse[0].coarsen(&fine[grid - 1]);
        Ok(())
    }

    fn refine(&mut self, grid: usize) -> Result<(), Error> {
        if grid + 1 == self.plan.grids() {
            self.messages[grid % 2].clear(self.plan.size(grid).pixels());
        } else if let [even, odd] = self.messages.as_mut_slice() {
            let (fine, coarse) = if grid.is_multiple_of(2) { (even, odd) } else { (odd, even) };
            refine(&self.plan, grid, coarse, fine);
        }
        Ok(())
    }

    /// Does nothing: the messages are still there.
    fn keep_messages(&mut self) -> Result<(), Error> {
        Ok(())
    }

    fn update_messages(&mut self, grid: usize, steps: Range<u32>) -> Result<(), Error> {
        for step in steps {
            let messages = &mut self.messages[grid % 2];
            let size = self.plan.size(grid);
            let grid = Grid { plan: &self.plan, index: grid, size, costs: &self.costs[grid], greys: &self.greys[grid] };
            update_messages(&grid, step, messages, &mut self.h);
        }
        Ok(())
    }

    fn select_labels(&mut self, labels: &mut [u16]) -> Result<(), Error> {
        let size = self.plan.image_size();
        let grid = Grid { plan: &self.plan, index: 0, size, costs: &self.costs[0], greys: &self.greys[0] };
        select_labels(&grid, &self.messages[0], labels, &mut self.h);
        Ok(())
    }

    fn read_messages(&mut self, side: Side, messages: &mut [u8]) -> Result<(), Error> {
        messages.copy_from_slice(self.messages[0].all_received(side));
        Ok(())
    }

    fn moved_bytes(&self) -> Option<[u64; Stage::ALL.len()]> {
        self.plan.moved_bytes()
    }

    fn allocated_bytes(&self) -> u64 {
        let costs: u64 = self.costs.iter().map(Costs::bytes).sum();
        let greys: u64 = self.greys.iter().map(Greys::bytes).sum();
        let messages: u64 = self.messages.iter().map(Messages::bytes).sum();
        let scratch = memory::bytes(&self.scratch) + memory::bytes(&self.h);
        self.data_cost.bytes() + costs + greys + messages + scratch
    }
}
