//! Composes the program of a plan.

mod buffers;
mod composer;
mod kernels;
mod label_sets;
mod parts;
mod recorder;
mod segments;
mod sweep;

use bp_core::{Error, Plan, Schedule};
use buffers::Buffers;
use composer::{Composer, PARAMETERS_ALIGNMENT};
use indexmap::IndexSet;
use recorder::Recorder;

use crate::{
    Buffer, Kernel, Limits, Memory, Program, Shape, WORKGROUP,
    group::{FEW_INVOCATIONS, Group},
    layout,
};

/// The number of full dispatches in a submission: few enough for watchdogs, progress reports and quick stopping, but
/// enough to make the cost of submitting negligible.
const DISPATCHES_PER_SUBMISSION: u64 = 8;

/// The most marks of a solve.
const MOST_MARKS: usize = 4096;

impl Program {
    /// The program of a plan.
    ///
    /// # Errors
    /// [`Error::Unsupported`] if a device with these limits cannot run it, [`Error::OutOfMemory`] if its buffers need more
    /// memory than is available.
    pub fn new(plan: &Plan, limits: &Limits) -> Result<Self, Error> {
        let program = compose(plan, limits)?;
        match limits.memory_bytes {
            Some(available) if program.bytes() > available => {
                Err(Error::OutOfMemory { what: "device buffers", needed: program.bytes(), available: Some(available) })
            }
            _ => Ok(program),
        }
    }

    /// The bytes that a driver of this plan uses on a device with these limits, including its labels on the host. If
    /// the device cannot run the plan, the bytes of the plan itself.
    #[must_use]
    pub fn planned_bytes(plan: &Plan, limits: &Limits) -> u64 {
        let labels = 2 * plan.image_size().pixels() as u64;
        compose(plan, limits).map_or_else(|_| plan.bytes(), |program| program.bytes().saturating_add(labels))
    }
}

/// Composes the program of a plan, however much memory it needs.
fn compose(plan: &Plan, limits: &Limits) -> Result<Program, Error> {
    check_schedule(plan, limits)?;
    check_sums(plan, limits)?;
    let grids = layout::grids(plan, limits)?;
    let buffers = Buffers::new(plan, &grids, limits);
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

/// Fails under a schedule in which only one node sends at a time.
fn check_schedule(plan: &Plan, limits: &Limits) -> Result<(), Error> {
    match plan.settings().schedule {
        Schedule::Sync | Schedule::Checkerboard | Schedule::Sweep => Ok(()),
        Schedule::Outward { .. } => {
            let reason = "the schedule outward runs on the backends scalar and rayon only".to_owned();
            Err(Error::Unsupported { device: limits.device.clone(), reason })
        }
    }
}

/// Fails if sums of data costs may exceed 32 bits.
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

/// Fails if buffers are too large or too many, or if a row needs more workgroups than a dispatch may have.
fn check_limits(plan: &Plan, buffers: &[Buffer], limits: &Limits) -> Result<(), Error> {
    let unsupported = |reason| Err(Error::Unsupported { device: limits.device.clone(), reason });
    if limits.bindings < Kernel::most_bindings() {
        let needed = Kernel::most_bindings();
        return unsupported(format!("a kernel needs {needed} buffers and it allows {}", limits.bindings));
    }
    if limits.shape == Shape::Slices && limits.invocations < FEW_INVOCATIONS {
        let allowed = limits.invocations;
        return unsupported(format!(
            "a workgroup needs {FEW_INVOCATIONS} invocations and it allows {allowed}: set BP_GPU_SHAPE=words"
        ));
    }
    let width = plan.pair_size().width;
    let most = limits.workgroups as usize * least_row_pixels(plan, limits);
    if width > most {
        return unsupported(format!("a row has {width} pixels and it computes at most {most} at a time"));
    }
    // Kernels never bind the buffers that the host reads and writes.
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

/// The least number of pixels of a row that a workgroup of any kernel covers.
fn least_row_pixels(plan: &Plan, limits: &Limits) -> usize {
    let sliced = 2 * layout::WORD_NODES * Group::of(Kernel::UpdateMessagesOfSlice, plan, limits).words as usize;
    sliced.min(WORKGROUP as usize)
}

impl Composer<'_> {
    fn program(mut self) -> Program {
        let (grids, periods) = (0..self.plan.grids(), self.periods());
        let submission_entries = DISPATCHES_PER_SUBMISSION.saturating_mul(self.limits.dispatch_entries);
        let mut recorder = Recorder::new(submission_entries);
        // This order must match Program::segments_of.
        self.match_cost(recorder.part());
        grids.clone().skip(1).for_each(|grid| self.coarsen(recorder.part(), grid));
        grids.clone().for_each(|grid| self.refine(recorder.part(), grid));
        for (grid, step) in grids.flat_map(|grid| (0..periods).map(move |step| (grid, step))) {
            self.step(recorder.part(), grid, step);
        }
        (0..=self.plan.halved()).for_each(|grid| self.select_labels(recorder.part(), grid));
        let (segments, parts) = recorder.finish(&self.bind_groups, &self.buffers.list);
        let parameters = self.parameter_blocks();
        let mut buffers = self.buffers.list.clone();
        buffers[Program::PARAMETERS].bytes = parameters.len() as u64;
        Program {
            marks: self.marks(submission_entries),
            last_sent: self.last_sent(),
            costs: self.buffers.strips[0].iter().map(|strip| strip.cost).collect(),
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

    /// The number of steps after which their commands repeat.
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

    /// One mark before the first stage, and one after every kernel call of the driver.
    fn marks(&self, submission_entries: u64) -> usize {
        let steps = fused_steps(self.plan, submission_entries);
        let updates = self.plan.settings().steps.div_ceil(steps) as usize;
        // More marks would not be worth their queries.
        (2 + self.plan.grids().saturating_mul(2 + updates)).min(MOST_MARKS)
    }

    /// The buffers of the last messages on grid 0.
    fn last_sent(&self) -> Vec<[[usize; 2]; 4]> {
        let set = self.set(self.plan.settings().steps);
        self.buffers.strips[0].iter().map(|strip| strip.sent[set]).collect()
    }
}

/// The number of steps on grid 0 that fill a submission.
pub(crate) fn fused_steps(plan: &Plan, submission_entries: u64) -> u32 {
    let steps = submission_entries / plan.updates_per_step(0).max(1);
    u32::try_from(steps).unwrap_or(u32::MAX).max(1)
}
