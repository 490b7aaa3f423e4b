//! The buffers of one plan, and the kernels that run on them.

use std::ops::Range;

use bp_core::{
    BAND_ROWS, DataCost, Error, IsStopped, Plan, Schedule, Seam, Seed, Side, Solver, Stage, StereoPair, memory,
};

use crate::{
    coarsen::coarsen, costs::Costs, greys::Greys, grid::Grid, label_sets, match_cost::match_cost, messages::Messages,
    refine::refine, seams::Seams, select_labels::select_labels, update_messages::update_messages,
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
    seams: Seams,
    /// The labels that determine the label sets of the next grid. Every grid's overwrite the coarser ones'.
    coarser: Vec<u16>,
    scratch: Vec<u64>,
    h: Vec<u8>,
}

impl ScalarSolver {
    /// Allocates all buffers.
    pub(crate) fn new(plan: &Plan, is_stopped: IsStopped<'_>) -> Result<Self, Error> {
        let labels = plan.model().labels();
        let messages = (0..plan.grids().min(2)).map(|grid| Messages::new(plan, grid, is_stopped));
        Ok(Self {
            data_cost: DataCost::new(plan.pair_size(), *plan.model())?,
            costs: (0..plan.grids()).map(|grid| Costs::new(plan, grid, is_stopped)).collect::<Result<_, _>>()?,
            greys: (0..plan.grids()).map(|grid| Greys::new(plan, grid)).collect::<Result<_, _>>()?,
            messages: messages.collect::<Result<_, _>>()?,
            seams: Seams::new(plan)?,
            coarser: memory::filled("labels", plan.coarser_labels(), 0)?,
            scratch: memory::filled("one node's costs", labels, 0)?,
            h: memory::filled("one node's message", labels, 0)?,
            plan: plan.clone(),
        })
    }
}

impl Solver for ScalarSolver {
    fn match_cost(&mut self, pair: &StereoPair, seed: Option<Seed>) -> Result<(), Error> {
        let seed = seed.map(|seed| Seed { x: seed.x + self.plan.margin(), ..seed });
        self.data_cost.load(pair, seed)?;
        self.greys[0].load(pair.left(), self.plan.margin());
        match_cost(&self.data_cost, &self.plan, &mut self.costs[0], &mut self.scratch);
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
        let height = self.plan.size(grid).height;
        self.first_messages(grid, 0..height);
        if self.plan.settings().schedule == Schedule::Sweep {
            self.prepare_seams(grid);
            self.bands(grid).for_each(|rows| self.restrict(grid, rows));
        }
        Ok(())
    }

    /// Does nothing: the messages are still there.
    fn keep_messages(&mut self) -> Result<(), Error> {
        Ok(())
    }

    fn update_messages(&mut self, grid: usize, steps: Range<u32>) -> Result<(), Error> {
        for step in steps {
            let on = on_grid(&self.plan, grid, &self.costs, &self.greys);
            update_messages(&on, step, &mut self.messages[grid % 2], &mut self.h);
            if self.plan.settings().schedule == Schedule::Sweep && step + 1 == self.plan.settings().steps {
                self.finish_sweeps(grid);
            }
        }
        Ok(())
    }

    fn select_labels(&mut self, grid: usize, labels: &mut [u16]) -> Result<(), Error> {
        if grid > 0 {
            labels.copy_from_slice(&self.coarser[..labels.len()]);
            return Ok(());
        }
        let grid = on_grid(&self.plan, 0, &self.costs, &self.greys);
        select_labels(&grid, &self.messages[0], &self.seams, labels, &mut self.h);
        Ok(())
    }

    fn read_messages(&mut self, side: Side, messages: &mut [u8]) -> Result<(), Error> {
        messages.copy_from_slice(self.messages[0].all_received(side));
        // A stored cost of 255 marks a label that the node's set lacks.
        if self.plan.has_label_sets(0) {
            let costs = (0..self.plan.image_size().pixels()).flat_map(|node| self.costs[0].of(node));
            messages.iter_mut().zip(costs).filter(|(_, cost)| **cost == u8::MAX).for_each(|(message, _)| *message = 0);
        }
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
        self.data_cost.bytes() + costs + greys + messages + self.seams.bytes() + memory::bytes(&self.coarser) + scratch
    }
}

impl ScalarSolver {
    /// Writes the first messages of these rows of a grid.
    fn first_messages(&mut self, grid: usize, rows: Range<usize>) {
        if grid + 1 == self.plan.grids() {
            let width = self.plan.size(grid).width;
            self.messages[grid % 2].clear(rows.start * width..rows.end * width);
        } else if let [even, odd] = self.messages.as_mut_slice() {
            let (fine, coarse) = if grid.is_multiple_of(2) { (even, odd) } else { (odd, even) };
            refine(&self.plan, grid, rows, coarse, fine);
        }
    }

    /// The rows of the bands of a grid.
    fn bands(&self, grid: usize) -> impl Iterator<Item = Range<usize>> + use<> {
        let height = self.plan.size(grid).height;
        (0..height).step_by(BAND_ROWS).map(move |first| first..height.min(first + BAND_ROWS))
    }

    /// Prepares all seams of a grid, which holds its first messages before and after.
    fn prepare_seams(&mut self, grid: usize) {
        let height = self.plan.size(grid).height;
        for seam in Seam::all(height) {
            self.restrict(grid, seam.rows());
            let on = on_grid(&self.plan, grid, &self.costs, &self.greys);
            self.seams.prepare(seam, &on, &mut self.messages[grid % 2], &mut self.h);
        }
        Seam::all(height).for_each(|seam| self.first_messages(grid, seam.rows()));
        let on = on_grid(&self.plan, grid, &self.costs, &self.greys);
        self.seams.apply(&on, &mut self.messages[grid % 2]);
        for seam in Seam::all(height) {
            let Range { start, end } = seam.rows();
            self.extend(grid, [start..end, seam.below..seam.below + 1], &[Side::Up]);
            self.extend(grid, [start..end, seam.below - 1..seam.below], &[Side::Down]);
        }
    }

    /// Forgets the messages down across seams, which count no longer. Decides the labels that determine label sets, and
    /// extends the messages that the first ones of the next finer grid are made from.
    fn finish_sweeps(&mut self, grid: usize) {
        self.messages[grid % 2].clear_side(Side::Up);
        if grid == 0 || !self.plan.decides_labels(grid) {
            return;
        }
        for rows in self.bands(grid) {
            self.extend(grid, [rows.clone(), rows], &[Side::Left, Side::Right, Side::Down]);
        }
        let labels = &mut self.coarser[..self.plan.size(grid).pixels()];
        let on = on_grid(&self.plan, grid, &self.costs, &self.greys);
        self.seams.decode(&on, &self.messages[grid % 2], labels, &mut self.h);
    }

    /// Gives rows that are passed together the costs of their label sets, if the grid has any.
    fn restrict(&mut self, grid: usize, rows: Range<usize>) {
        if self.plan.has_label_sets(grid) {
            label_sets::restrict(&self.plan, grid, rows, &self.coarser, &mut self.costs[grid], &mut self.scratch);
        }
    }

    /// Extends messages that some of the rows that were passed together received, if the grid has label sets.
    fn extend(&mut self, grid: usize, rows: [Range<usize>; 2], sides: &[Side]) {
        if self.plan.has_label_sets(grid) {
            label_sets::extend(&self.plan, grid, rows, &self.coarser, sides, &mut self.messages[grid % 2]);
        }
    }
}

/// A grid with its costs and grey values.
fn on_grid<'a>(plan: &'a Plan, index: usize, costs: &'a [Costs], greys: &'a [Greys]) -> Grid<'a> {
    Grid { plan, index, size: plan.size(index), costs: &costs[index], greys: &greys[index] }
}
