//! Builds a program: records dispatches with their buffers and parameters.

use bp_core::{Model, Plan, Schedule, Smoothness};
use indexmap::IndexSet;

use super::{
    buffers::{Buffers, StripBuffers},
    recorder::PartRecorder,
};
use crate::{BindGroup, Command, Limits, Parameters, Pipeline, group::Group, layout::Grid};

/// The alignment of dynamic offsets: the largest of any device.
pub(super) const PARAMETERS_ALIGNMENT: usize = 256;

/// The nodes that a dispatch computes.
#[derive(Clone, Copy)]
pub(super) struct Nodes {
    pub(super) grid: usize,
    pub(super) strip: usize,
    pub(super) colour: usize,
}

/// The rows of a strip that a dispatch computes: `span` rows from each of `count` rows on, apart from those beyond the strip.
#[derive(Clone, Copy)]
pub(super) struct Rows {
    pub(super) first: usize,
    pub(super) step: usize,
    pub(super) count: usize,
    pub(super) span: usize,
}

impl Rows {
    /// So many rows from the top of a strip on.
    pub(super) fn from_top(count: usize) -> Self {
        Self { first: 0, step: 1, count, span: 1 }
    }
}

/// How many labels an offer may pass before it costs as much as the truncation, on edges of any level.
fn reach(model: &Model) -> u32 {
    let of_level = |level: Smoothness| match (level.truncation, level.step()) {
        (0, _) => 0,
        (_, 0) => model.labels() as u32,
        (truncation, step) => u32::from(truncation.div_ceil(step)) - 1,
    };
    model.edges().smoothness().map(of_level).into_iter().max().unwrap_or(0)
}

/// A program under construction.
pub(super) struct Composer<'a> {
    pub(super) plan: &'a Plan,
    pub(super) limits: &'a Limits,
    pub(super) grids: &'a [Grid],
    pub(super) buffers: &'a Buffers,
    pub(super) parameters: IndexSet<Parameters>,
    pub(super) pipelines: IndexSet<Pipeline>,
    pub(super) bind_groups: IndexSet<BindGroup>,
}

/// The parameters of a dispatch, its rows, and the number of items in a row: words, unless a kernel says otherwise.
pub(super) struct Work {
    pub(super) parameters: Parameters,
    pub(super) rows: Rows,
    pub(super) row_items: usize,
}

impl Composer<'_> {
    /// The set of message buffers that a step reads. Under [`Schedule::Sync`] it writes the other set.
    pub(super) fn set(&self, step: u32) -> usize {
        if self.plan.settings().schedule == Schedule::Sync { step as usize % 2 } else { 0 }
    }

    /// Records a kernel for rows of a strip, in as many dispatches as the limits require.
    pub(super) fn dispatch(
        &mut self,
        part: &mut PartRecorder,
        mut pipeline: Pipeline,
        buffers: Vec<usize>,
        work: Work,
    ) {
        let kernel = pipeline.kernel;
        let group = Group::of(kernel, self.plan, self.limits);
        if kernel.is_sliced() {
            pipeline.constants.extend([("GROUP_WORDS", group.words), ("SLICES", group.slices)]);
        }
        let pipeline = self.pipelines.insert_full(pipeline).0;
        let bind_group = self.bind_groups.insert_full(BindGroup { kernel, buffers }).0;
        let Rows { first, step, count, span } = work.rows;
        let most = self.rows_per_dispatch(&work, group);
        // Where no dispatch can have the rows of a band together, it has single ones.
        let (spans, span) = if span > most { (span, 1) } else { (1, span) };
        let steps = (0..spans).flat_map(|i| (0..count).step_by(most / span).map(move |done| (i, done)));
        for (i, done) in steps {
            let rows = span * (most / span).min(count - done);
            let row = first + i + done * step;
            let (row_step, span) = (step as u32, span as u32);
            let block = Parameters { row: row as u32, row_step, rows: rows as u32, span, ..work.parameters };
            let parameters = (self.parameters.insert_full(block).0 * PARAMETERS_ALIGNMENT) as u32;
            let workgroups = group.number(rows, work.row_items) as u32;
            let command = Command::Dispatch { pipeline, bind_group, parameters, workgroups };
            part.push(command, rows as u64 * self.row_entries(&work));
        }
    }

    /// The message entries that a row of this work counts as. For an item, a kernel computes four messages at four nodes for every
    /// label, or does less work.
    fn row_entries(&self, work: &Work) -> u64 {
        work.row_items as u64 * 16 * self.plan.model().labels() as u64
    }

    /// How many rows a dispatch may compute.
    fn rows_per_dispatch(&self, work: &Work, group: Group) -> usize {
        let by_time = self.limits.dispatch_entries / self.row_entries(work).max(1);
        let by_count = group.rows(self.limits.workgroups as usize, work.row_items);
        usize::try_from(by_time).unwrap_or(usize::MAX).min(by_count).max(1)
    }

    /// The parameters of a strip's nodes of one colour, for these rows.
    pub(super) fn work(&self, nodes: Nodes, rows: Rows) -> Work {
        let grid = &self.grids[nodes.grid];
        let (model, cut) = (self.plan.model(), self.plan.settings().cut);
        let parameters = Parameters {
            width: grid.size.width as u32,
            height: grid.size.height as u32,
            words: grid.words as u32,
            labels: model.labels() as u32,
            quads: grid.quads as u32,
            first_row: grid.strips[nodes.strip].first as u32,
            strip_rows: grid.strips[nodes.strip].rows as u32,
            colour: nodes.colour as u32,
            slopes: model.edges().smoothness().map(|level| level.slope.into()),
            truncations: model.edges().smoothness().map(|level| level.truncation.into()),
            steps: model.edges().smoothness().map(|level| level.step().into()),
            most: model.edges().most().map(u32::from),
            clip: self.plan.clip(nodes.grid).into(),
            min_disparity: model.min_disparity(),
            reach: reach(model),
            padding_cost: model.clip().into(),
            cut_x: cut.map_or(0, |cut| cut.x as u32),
            cut_y: cut.map_or(0, |cut| cut.y as u32),
            ..Parameters::default()
        };
        Work { parameters, rows, row_items: grid.words }
    }

    /// All rows of a strip.
    pub(super) fn all_rows(&self, nodes: Nodes) -> Work {
        self.work(nodes, Rows::from_top(self.grids[nodes.grid].strips[nodes.strip].rows))
    }

    /// The nodes of every strip and colour of a grid.
    pub(super) fn nodes(&self, grid: usize) -> impl Iterator<Item = Nodes> + use<> {
        let strips = 0..self.grids[grid].strips.len();
        strips.flat_map(move |strip| [0, 1].map(|colour| Nodes { grid, strip, colour }))
    }

    pub(super) fn strip(&self, nodes: Nodes) -> &StripBuffers {
        &self.buffers.strips[nodes.grid][nodes.strip]
    }
}
