//! Composes the program of a plan.

mod buffers;
mod segments;
mod sweep;

use bp_core::{Error, Plan, Schedule, Stage};
use indexmap::IndexSet;

use crate::{
    BindGroup, Buffer, Command, Kernel, Limits, Memory, Parameters, Pipeline, Program, Segment, WORKGROUP,
    compose::buffers::{Buffers, StripBuffers},
    layout::{self, Grid},
};

/// Alignment of dynamic offsets: the most that any device asks for.
const PARAMETERS_ALIGNMENT: usize = 256;

/// How many full dispatches a submission holds: few enough for progress to be told and stopping to be quick, enough for
/// handing over to take no time in comparison.
const DISPATCHES_PER_SUBMISSION: u64 = 8;

/// Most marks that are kept.
const MOST_MARKS: usize = 4096;

/// The program of a plan, whatever memory it needs.
pub(crate) fn compose(plan: &Plan, limits: &Limits) -> Result<Program, Error> {
    check_sums(plan, limits)?;
    let grids = layout::grids(plan, limits)?;
    let buffers = Buffers::new(plan, &grids);
    check_buffers(&buffers.list, limits)?;
    let composer = Composer {
        plan,
        limits,
        grids: &grids,
        buffers: &buffers,
        parameters: IndexSet::new(),
        pipelines: IndexSet::new(),
        bind_groups: IndexSet::new(),
    };
    Ok(composer.program())
}

/// Refuses data cost sums that 32 bits may not hold.
fn check_sums(plan: &Plan, limits: &Limits) -> Result<(), Error> {
    let model = plan.model();
    let of_image = u64::from(model.profile().max_cost()).saturating_mul(plan.image_size().pixels() as u64);
    let largest = model.max_cost(plan.grids() - 1).min(of_image);
    if largest <= u32::MAX.into() {
        return Ok(());
    }
    let reason = format!("data costs summed over {} grids exceed 32 bits: take fewer grids", plan.grids());
    Err(Error::Unsupported { device: limits.device.clone(), reason })
}

/// Refuses buffers that are too large or too many.
fn check_buffers(buffers: &[Buffer], limits: &Limits) -> Result<(), Error> {
    let unsupported = |reason| Err(Error::Unsupported { device: limits.device.clone(), reason });
    if limits.bindings < Kernel::most_bindings() {
        let needed = Kernel::most_bindings();
        return unsupported(format!("a kernel needs {needed} buffers and it allows {}", limits.bindings));
    }
    // Kernels are not given what the host reads and writes.
    let most = |buffer: &Buffer| match buffer.memory {
        Memory::Device => limits.binding_bytes.min(limits.buffer_bytes),
        Memory::Upload | Memory::Download => limits.buffer_bytes,
    };
    match buffers.iter().find(|buffer| buffer.bytes > most(buffer)) {
        Some(buffer) => {
            let (name, bytes, most) = (buffer.name, buffer.bytes, most(buffer));
            unsupported(format!("{name} take {bytes} bytes and its buffers hold at most {most}: take a smaller image"))
        }
        None => Ok(()),
    }
}

/// Which nodes a dispatch computes.
#[derive(Clone, Copy)]
struct Nodes {
    grid: usize,
    strip: usize,
    colour: usize,
}

/// Which rows of a strip a kernel computes.
#[derive(Clone, Copy)]
struct Rows {
    first: usize,
    step: usize,
    count: usize,
}

/// A program in the making.
struct Composer<'a> {
    plan: &'a Plan,
    limits: &'a Limits,
    grids: &'a [Grid],
    buffers: &'a Buffers,
    parameters: IndexSet<Parameters>,
    pipelines: IndexSet<Pipeline>,
    bind_groups: IndexSet<BindGroup>,
}

impl Composer<'_> {
    fn program(mut self) -> Program {
        let grids = 0..self.plan.grids();
        // In the order of Program::segment.
        let mut segments = vec![self.match_cost()];
        segments.extend(grids.clone().skip(1).map(|grid| self.coarsen(grid)));
        segments.extend(grids.clone().map(|grid| self.refine(grid)));
        segments.extend(grids.flat_map(|grid| [(grid, 0), (grid, 1)]).map(|(grid, step)| self.step(grid, step)));
        segments.push(self.select_labels());
        let parameters = self.parameter_blocks();
        let mut buffers = self.buffers.list.clone();
        buffers[Program::PARAMETERS].bytes = parameters.len() as u64;
        let submission_entries = DISPATCHES_PER_SUBMISSION.saturating_mul(self.limits.dispatch_entries);
        Program {
            marks: self.marks(submission_entries),
            last_sent: self.last_sent(),
            parameters,
            pipelines: self.pipelines.into_iter().collect(),
            bind_groups: self.bind_groups.into_iter().collect(),
            buffers,
            segments,
            submission_entries,
            grids: self.grids.to_vec(),
        }
    }

    fn parameter_blocks(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(self.parameters.len() * PARAMETERS_ALIGNMENT);
        for block in &self.parameters {
            bytes.extend_from_slice(bytemuck::bytes_of(block));
            bytes.resize(bytes.len().next_multiple_of(PARAMETERS_ALIGNMENT), 0);
        }
        bytes
    }

    /// A mark before the first stage, and one behind every call of a kernel that the driver makes.
    fn marks(&self, submission_entries: u64) -> usize {
        let steps = fused_steps(self.plan, submission_entries);
        let updates = self.plan.settings().steps.div_ceil(steps) as usize;
        // Beyond this device times are not worth their queries.
        (2 + self.plan.grids().saturating_mul(2 + updates)).min(MOST_MARKS)
    }

    /// Buffers of what was sent last on grid 0.
    fn last_sent(&self) -> Vec<[[usize; 2]; 4]> {
        let set = self.set(self.plan.settings().steps);
        self.buffers.strips[0].iter().map(|strip| strip.sent[set]).collect()
    }

    /// Which set of message buffers holds what was sent before a step. Under [`Schedule::Sync`] a step reads one set and
    /// writes the other.
    fn set(&self, step: u32) -> usize {
        if self.plan.settings().schedule == Schedule::Sync { step as usize % 2 } else { 0 }
    }

    fn segment(&self, stage: Stage, commands: Vec<Command>) -> Segment {
        let bound = commands.iter().filter_map(|command| match command {
            Command::Dispatch { bind_group, .. } => Some(&self.bind_groups[*bind_group].buffers),
            _ => None,
        });
        let buffers: IndexSet<usize> = bound.flatten().copied().collect();
        let moved_bytes = buffers.into_iter().map(|buffer| self.buffers.list[buffer].bytes).sum();
        Segment { stage, commands, moved_bytes }
    }

    /// Appends dispatches of a kernel to rows of a strip, as many as the limits ask for.
    fn dispatch(&mut self, commands: &mut Vec<Command>, pipeline: Pipeline, buffers: Vec<usize>, work: Work) {
        let kernel = pipeline.kernel;
        let pipeline = self.pipelines.insert_full(pipeline).0;
        let bind_group = self.bind_groups.insert_full(BindGroup { kernel, buffers }).0;
        let most = self.rows_per_dispatch(&work);
        for done in (0..work.rows.count).step_by(most) {
            let rows = most.min(work.rows.count - done);
            let row = work.rows.first + done * work.rows.step;
            let row_step = work.rows.step as u32;
            let block = Parameters { row: row as u32, row_step, rows: rows as u32, ..work.parameters };
            let parameters = (self.parameters.insert_full(block).0 * PARAMETERS_ALIGNMENT) as u32;
            let workgroups = (rows * work.row_invocations).div_ceil(WORKGROUP as usize) as u32;
            commands.push(Command::Dispatch { pipeline, bind_group, parameters, workgroups });
        }
    }

    /// How many rows a dispatch may compute: an invocation makes four messages at four nodes for every label, or less.
    fn rows_per_dispatch(&self, work: &Work) -> usize {
        let row = work.row_invocations as u64;
        let entries = row * 16 * self.plan.model().labels() as u64;
        let by_time = self.limits.dispatch_entries / entries.max(1);
        let by_count = u64::from(self.limits.workgroups) * u64::from(WORKGROUP) / row.max(1);
        usize::try_from(by_time.min(by_count)).unwrap_or(usize::MAX).max(1)
    }

    /// The parameters of a strip's nodes of one colour, on rows that are still to be told.
    fn work(&self, nodes: Nodes, rows: Rows) -> Work {
        let grid = &self.grids[nodes.grid];
        let (model, cut) = (self.plan.model(), self.plan.settings().cut);
        let parameters = Parameters {
            width: grid.size.width as u32,
            height: grid.size.height as u32,
            words: grid.words as u32,
            labels: model.labels() as u32,
            quads: grid.quads as u32,
            first_row: grid.strips[nodes.strip].first as u32,
            colour: nodes.colour as u32,
            slope: model.slope().into(),
            truncation: model.truncation().into(),
            step: model.step().into(),
            clip: self.plan.clip(nodes.grid).into(),
            min_disparity: model.min_disparity(),
            padding_cost: model.clip().into(),
            cut_x: cut.map_or(0, |cut| cut.x as u32),
            cut_y: cut.map_or(0, |cut| cut.y as u32),
            ..Parameters::default()
        };
        Work { parameters, rows, row_invocations: grid.words }
    }

    /// All rows of a strip.
    fn all_rows(&self, nodes: Nodes) -> Work {
        let count = self.grids[nodes.grid].strips[nodes.strip].rows;
        self.work(nodes, Rows { first: 0, step: 1, count })
    }

    /// The nodes of every strip and colour of a grid.
    fn nodes(&self, grid: usize) -> impl Iterator<Item = Nodes> + use<> {
        let strips = 0..self.grids[grid].strips.len();
        strips.flat_map(move |strip| [0, 1].map(|colour| Nodes { grid, strip, colour }))
    }

    fn strip(&self, nodes: Nodes) -> &StripBuffers {
        &self.buffers.strips[nodes.grid][nodes.strip]
    }
}

/// Parameters of a dispatch, its rows, and how many invocations a row takes.
struct Work {
    parameters: Parameters,
    rows: Rows,
    row_invocations: usize,
}

/// How many steps make up a submission on grid 0.
pub(crate) fn fused_steps(plan: &Plan, submission_entries: u64) -> u32 {
    let steps = submission_entries / plan.updates_per_step(0).max(1);
    u32::try_from(steps).unwrap_or(u32::MAX).max(1)
}
