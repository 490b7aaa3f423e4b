//! The commands of every part of a program.

use bp_core::{MessageStart, Schedule, Side, image::APRON};

use super::{
    composer::{Composer, Nodes, Rows, Work},
    recorder::PartRecorder,
};
use crate::{
    Command, Kernel, Parameters, Pipeline, Program,
    answer::{SEED_BYTES, image_bytes, label_bytes},
    layout::Strip,
};

// The values of START in refine.wgsl.
const START_RECEIVER: u32 = 0;
const START_SENDER: u32 = 1;
const START_SWEEP: u32 = 2;
const START_ZERO: u32 = 3;

impl Composer<'_> {
    pub(super) fn match_cost(&mut self, part: &mut PartRecorder) {
        let (buffers, size) = (self.buffers, self.plan.pair_size());
        let image = image_bytes(size);
        let upload =
            |to, from_offset, bytes| Command::Copy { from: Program::UPLOAD, from_offset, to, to_offset: 0, bytes };
        part.push_short(upload(buffers.images[0], 0, image));
        part.push_short(upload(buffers.images[1], image, image));
        part.push_short(upload(buffers.seed, 2 * image, SEED_BYTES));
        part.push_short(Command::Barrier);
        let compared = self.plan.model().profile();
        let profile = ("PROFILE", compared as u32);
        for side in 0..2 {
            let parameters =
                Parameters { width: size.width as u32, height: size.height as u32, ..Parameters::default() };
            let work = Work { parameters, rows: Rows::from_top(size.height), row_items: size.width };
            let constants = vec![profile, ("APRON", APRON as u32)];
            let pipeline = Pipeline { kernel: Kernel::Features, constants };
            self.dispatch(part, pipeline, vec![buffers.images[side], buffers.features[side]], work);
        }
        self.greys(part);
        part.push_short(Command::Barrier);
        self.edge_costs(part, 0);
        for nodes in self.nodes(0) {
            let constants = vec![
                profile,
                ("LARGEST_COST", compared.max_cost().into()),
                ("OUT_OF_RANGE_COST", compared.out_of_range_cost().into()),
                ("SUM_BYTES", self.grids[0].sum_bytes as u32),
                ("MARGIN", self.plan.margin() as u32),
            ];
            let pipeline = Pipeline { kernel: Kernel::MatchCost, constants };
            let [left, right] = buffers.features;
            let bound = [self.costs_written(nodes).as_slice(), &[left, right, buffers.seed]].concat();
            self.dispatch(part, pipeline, bound, self.all_rows(nodes));
        }
    }

    /// The grey values of the left image, if the model has edges of several levels.
    fn greys(&mut self, part: &mut PartRecorder) {
        let Some(greys) = &self.buffers.greys else { return };
        let constants = vec![("APRON", APRON as u32), ("MARGIN", self.plan.margin() as u32)];
        let pipeline = Pipeline { kernel: Kernel::Greys, constants };
        for colour in 0..2 {
            let bound = vec![self.buffers.images[0], greys[0]];
            self.dispatch(part, pipeline.clone(), bound, self.whole_grid(0, colour));
        }
    }

    /// The costs of the edges of a grid, if they differ and kernels read them. The grid's grey values must be known.
    fn edge_costs(&mut self, part: &mut PartRecorder, grid: usize) {
        let (Some(greys), Some(edges)) = (&self.buffers.greys, &self.buffers.edges) else { return };
        let pipeline = Pipeline { kernel: Kernel::EdgeCosts, constants: vec![self.finds_levels()] };
        for colour in 0..2 {
            self.dispatch(part, pipeline.clone(), vec![edges[grid], greys[grid]], self.whole_grid(grid, colour));
        }
    }

    /// The grey values of a coarser grid.
    fn coarsen_greys(&mut self, part: &mut PartRecorder, grid: usize) {
        let Some(greys) = &self.buffers.greys else { return };
        let pipeline = Pipeline { kernel: Kernel::CoarsenGreys, constants: Vec::new() };
        for colour in 0..2 {
            let from = self.grids[grid - 1].strips[0];
            let work = self.reading(self.whole_grid(grid, colour), grid - 1, from);
            self.dispatch(part, pipeline.clone(), vec![greys[grid - 1], greys[grid]], work);
        }
        part.push_short(Command::Barrier);
        self.edge_costs(part, grid);
    }

    /// The nodes of one colour in all rows of a grid, for buffers that are not cut into strips.
    pub(super) fn whole_grid(&self, grid: usize, colour: usize) -> Work {
        let height = self.grids[grid].size.height;
        let mut work = self.work(Nodes { grid, strip: 0, colour }, Rows::from_top(height));
        work.parameters.strip_rows = height as u32;
        work
    }

    /// The buffers that store the data costs of these nodes.
    fn costs_written(&self, nodes: Nodes) -> [usize; 2] {
        let strip = self.strip(nodes);
        let sums = strip.sums.map_or(self.buffers.unused_written, |sums| sums[nodes.colour]);
        [strip.cost[nodes.colour], sums]
    }

    /// Computes the costs of a grid. Every strip of the finer grid yields the rows that it covers.
    pub(super) fn coarsen(&mut self, part: &mut PartRecorder, grid: usize) {
        self.coarsen_greys(part, grid);
        let (fine, coarse) = (&self.grids[grid - 1], &self.grids[grid]);
        let constants = vec![("SUM_BYTES", coarse.sum_bytes as u32), ("FINE_SUM_BYTES", fine.sum_bytes as u32)];
        let pipeline = Pipeline { kernel: Kernel::Coarsen, constants };
        for (read, &from) in fine.strips.iter().enumerate() {
            let strip = coarse.strip_of(from.first / 2);
            let first = from.first / 2 - coarse.strips[strip].first;
            let rows = Rows { first, ..Rows::from_top(from.rows.div_ceil(2)) };
            for nodes in [0, 1].map(|colour| Nodes { grid, strip, colour }) {
                let work = self.reading(self.work(nodes, rows), grid - 1, from);
                let children = &self.buffers.strips[grid - 1][read];
                let sums = children.sums.unwrap_or([self.buffers.unused; 2]);
                let bound = [self.costs_written(nodes), children.cost, sums].concat();
                self.dispatch(part, pipeline.clone(), bound, work);
            }
        }
    }

    /// The same work, reading a strip of another grid.
    pub(super) fn reading(&self, work: Work, grid: usize, strip: Strip) -> Work {
        let other = &self.grids[grid];
        let parameters = Parameters {
            other_width: other.size.width as u32,
            other_height: other.size.height as u32,
            other_words: other.words as u32,
            other_first_row: strip.first as u32,
            ..work.parameters
        };
        Work { parameters, ..work }
    }

    pub(super) fn refine(&mut self, part: &mut PartRecorder, grid: usize) {
        for (nodes, side) in self.nodes(grid).flat_map(|nodes| Side::ALL.map(|side| (nodes, side))) {
            if self.starts(nodes, side) && grid + 1 < self.plan.grids() {
                self.refine_rows(part, nodes, side, Rows::from_top(self.grids[grid].strips[nodes.strip].rows));
            } else {
                let sent = self.strip(nodes).sent[0][side as usize][nodes.colour];
                part.push_short(Command::Clear { buffer: sent });
            }
        }
        self.join_strips(part, grid, 0, &[Side::Up, Side::Down]);
        if self.plan.settings().schedule == Schedule::Sweep {
            part.push_short(Command::Barrier);
            self.prepare_seams(part, grid);
            self.restrict_bands(part, grid);
        }
    }

    /// Whether these nodes start with the messages of the coarser grid to that side; see [`Schedule::Sweep`].
    pub(super) fn starts(&self, nodes: Nodes, side: Side) -> bool {
        self.plan.settings().schedule != Schedule::Sweep
            || match side {
                Side::Up => true,
                Side::Down => false,
                Side::Left | Side::Right => nodes.colour == 1,
            }
    }

    /// Records the first messages that these rows send to a side.
    pub(super) fn refine_rows(&mut self, part: &mut PartRecorder, nodes: Nodes, side: Side, rows: Rows) {
        let settings = self.plan.settings();
        let sent = self.strip(nodes).sent[0][side as usize][nodes.colour];
        let mut work = self.work(nodes, rows);
        work.parameters.side = side as u32;
        work.row_items = work.row_items.div_ceil(2);
        let (start, planes) = match self.grids.get(nodes.grid + 1) {
            Some(coarse) => {
                let from = coarse.strip_of(self.grids[nodes.grid].strips[nodes.strip].first / 2);
                work = self.reading(work, nodes.grid + 1, coarse.strips[from]);
                let sent = &self.buffers.strips[nodes.grid + 1][from].sent[self.set(settings.steps)];
                let start = match settings.message_start {
                    _ if settings.schedule == Schedule::Sweep => START_SWEEP,
                    MessageStart::Receiver => START_RECEIVER,
                    MessageStart::Sender => START_SENDER,
                };
                (start, sent[side as usize])
            }
            None => (START_ZERO, [self.buffers.unused; 2]),
        };
        let pipeline = Pipeline { kernel: Kernel::Refine, constants: vec![("START", start)] };
        self.dispatch(part, pipeline, vec![sent, planes[0], planes[1]], work);
    }

    /// Records one step, which depends only on the previous step, or one loop of [`Schedule::Sweep`].
    pub(super) fn step(&mut self, part: &mut PartRecorder, grid: usize, step: u32) {
        let (read, written) = (self.set(step), self.set(step + 1));
        match self.plan.settings().schedule {
            Schedule::Sync => {
                self.nodes(grid).for_each(|nodes| self.update(part, nodes, read, written));
                self.join_strips(part, grid, written, &[Side::Up, Side::Down]);
            }
            Schedule::Checkerboard => {
                let colour = step as usize % 2;
                let nodes = self.nodes(grid).filter(|nodes| nodes.colour == colour);
                nodes.for_each(|nodes| self.update(part, nodes, read, written));
                self.join_strips(part, grid, written, &[Side::Up, Side::Down]);
            }
            Schedule::Sweep => self.sweep(part, grid),
            Schedule::Outward { .. } => unreachable!("no such plan is composed"),
        }
    }

    fn update(&mut self, part: &mut PartRecorder, nodes: Nodes, read: usize, written: usize) {
        let pipeline = self.update_pipeline(false);
        let bound = self.messages(nodes, read, written);
        self.dispatch(part, pipeline, bound, self.all_rows(nodes));
    }

    /// Copies the messages to these sides in the rows beside the border of two strips to the buffers of the other strip.
    pub(super) fn join_strips(&self, part: &mut PartRecorder, grid: usize, set: usize, sides: &[Side]) {
        let (layout, strips) = (&self.grids[grid], &self.buffers.strips[grid]);
        let bytes = layout.row_bytes();
        for upper in 0..strips.len() - 1 {
            if upper == 0 {
                part.push_short(Command::Barrier);
            }
            let rows = layout.strips[upper].rows as u64;
            for (&side, colour) in sides.iter().flat_map(|side| [0, 1].map(|colour| (side, colour))) {
                let buffer = |strip: usize| strips[strip].sent[set][side as usize][colour];
                let mut copy = |from, from_row: u64, to, to_row: u64| {
                    let (from, to) = (buffer(from), buffer(to));
                    let (from_offset, to_offset) = (from_row * bytes, to_row * bytes);
                    part.push_short(Command::Copy { from, from_offset, to, to_offset, bytes });
                };
                // Row 0 of a strip is the second row of its planes.
                copy(upper, rows, upper + 1, 0);
                copy(upper + 1, 1, upper, rows + 1);
            }
        }
    }

    /// Records that the labels of a grid are decided, unless its sweep did, and handed out.
    pub(super) fn select_labels(&mut self, part: &mut PartRecorder, grid: usize) {
        if grid > 0 {
            // The sweep decided them.
        } else if self.plan.settings().schedule == Schedule::Sweep {
            self.decode(part, 0);
        } else {
            for nodes in self.nodes(0) {
                self.select(part, nodes, self.all_rows(nodes));
            }
        }
        let (from, bytes) = (self.buffers.labels[grid], label_bytes(self.plan.size(grid)));
        part.push_short(Command::Barrier);
        part.push_short(Command::Copy { from, from_offset: 0, to: Program::DOWNLOAD, to_offset: 0, bytes });
    }
}
