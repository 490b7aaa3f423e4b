//! Composes the program of a plan.

mod buffers;
mod parts;
mod recorder;
mod sweep;

use bp_core::{Error, Plan, Schedule};
use indexmap::IndexSet;

use crate::{
    BindGroup, Buffer, Command, Kernel, Limits, Memory, Parameters, Pipeline, Program, WORKGROUP,
    compose::{
        buffers::{Buffers, StripBuffers},
        recorder::{PartRecorder, Recorder},
    },
    layout::{self, Grid},
};

/// Alignment of dynamic offsets: the most that any device asks for.
const PARAMETERS_ALIGNMENT: usize = 256;

/// How many full dispatches a submission holds: few enough for watchdogs, for progress to be told and stopping to be quick,
/// enough for handing over to take no time in comparison.
const DISPATCHES_PER_SUBMISSION: u64 = 8;

/// Most marks that are kept.
const MOST_MARKS: usize = 4096;

/// The program of a plan, whatever memory it needs.
pub(crate) fn compose(plan: &Plan, limits: &Limits) -> Result<Program, Error> {
    check_sums(plan, limits)?;
    let grids = layout::grids(plan, limits)?;
    let buffers = Buffers::new(plan, &grids);
    check_limits(plan, &buffers.list, limits)?;
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

/// Refuses buffers that are too large or too many, and rows of more workgroups than a dispatch may have.
fn check_limits(plan: &Plan, buffers: &[Buffer], limits: &Limits) -> Result<(), Error> {
    let unsupported = |reason| Err(Error::Unsupported { device: limits.device.clone(), reason });
    if limits.bindings < Kernel::most_bindings() {
        let needed = Kernel::most_bindings();
        return unsupported(format!("a kernel needs {needed} buffers and it allows {}", limits.bindings));
    }
    let width = plan.image_size().width;
    if width.div_ceil(WORKGROUP as usize) > limits.workgroups as usize {
        let most = limits.workgroups as usize * WORKGROUP as usize;
        return unsupported(format!("a row has {width} pixels and it computes at most {most} at a time"));
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
        let (grids, periods) = (0..self.plan.grids(), self.periods());
        let submission_entries = DISPATCHES_PER_SUBMISSION.saturating_mul(self.limits.dispatch_entries);
        let mut recorder = Recorder::new(submission_entries);
        // In the order of Program::segments_of.
        self.match_cost(recorder.part());
        grids.clone().skip(1).for_each(|grid| self.coarsen(recorder.part(), grid));
        grids.clone().for_each(|grid| self.refine(recorder.part(), grid));
        for (grid, step) in grids.flat_map(|grid| (0..periods).map(move |step| (grid, step))) {
            self.step(recorder.part(), grid, step);
        }
        self.select_labels(recorder.part());
        let (segments, parts) = recorder.finish(&self.bind_groups, &self.buffers.list);
        let parameters = self.parameter_blocks();
        let mut buffers = self.buffers.list.clone();
        buffers[Program::PARAMETERS].bytes = parameters.len() as u64;
        Program {
            marks: self.marks(submission_entries),
            last_sent: self.last_sent(),
            parameters,
            pipelines: self.pipelines.into_iter().collect(),
            bind_groups: self.bind_groups.into_iter().collect(),
            buffers,
            segments,
            parts,
            periods,
            submission_entries,
            grids: self.grids.to_vec(),
        }
    }

    /// After how many steps they repeat.
    fn periods(&self) -> u32 {
        if self.plan.settings().schedule == Schedule::Sweep { 1 } else { 2 }
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

    /// Records dispatches of a kernel to rows of a strip, as many as the limits ask for.
    fn dispatch(&mut self, part: &mut PartRecorder, pipeline: Pipeline, buffers: Vec<usize>, work: Work) {
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
            let command = Command::Dispatch { pipeline, bind_group, parameters, workgroups };
            part.push(command, rows as u64 * self.row_entries(&work));
        }
    }

    /// Message entries that a row of this work is worth: an invocation makes four messages at four nodes for every label,
    /// or does less.
    fn row_entries(&self, work: &Work) -> u64 {
        work.row_invocations as u64 * 16 * self.plan.model().labels() as u64
    }

    /// How many rows a dispatch may compute.
    fn rows_per_dispatch(&self, work: &Work) -> usize {
        let by_time = self.limits.dispatch_entries / self.row_entries(work).max(1);
        let by_count = self.limits.workgroups as usize * WORKGROUP as usize / work.row_invocations.max(1);
        usize::try_from(by_time).unwrap_or(usize::MAX).min(by_count).max(1)
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
            step: model.smoothness().step().into(),
            weak_slope: model.smoothness().weakened().slope.into(),
            weak_truncation: model.smoothness().weakened().truncation.into(),
            weak_step: model.smoothness().weakened().step().into(),
            edge_threshold: model.weak_edges().unwrap_or(u8::MAX).into(),
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
