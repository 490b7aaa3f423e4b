//! The commands of a program. wgpu runs a recording only once, so they are encoded again for every solve.

use bp_core::Error;
use bp_gpu::{Command, Program};
use wgpu::{
    BindGroup, Buffer, CommandEncoder, CommandEncoderDescriptor, ComputePassDescriptor, ComputePipeline,
    SubmissionIndex,
};

use crate::{buffers, gpu::Gpu};

/// The commands of a program, and the resources they use.
pub(crate) struct Recording {
    /// The buffers of the program.
    pub(crate) buffers: Vec<Buffer>,
    pipelines: Vec<ComputePipeline>,
    bind_groups: Vec<BindGroup>,
    segments: Vec<Vec<Command>>,
}

impl Recording {
    /// Binds the buffers of a program. Call this under [`Gpu::guard`].
    pub(crate) fn new(gpu: &Gpu, program: &Program, buffers: Vec<Buffer>, pipelines: Vec<ComputePipeline>) -> Self {
        let bind_groups = program.bind_groups.iter().map(|group| buffers::bind(gpu, group, &buffers)).collect();
        // wgpu inserts barriers itself.
        let commands = program.segments.iter().map(|segment| segment.commands.iter());
        let segments = commands.map(|all| all.filter(|command| **command != Command::Barrier).cloned().collect());
        Self { bind_groups, segments: segments.collect(), buffers, pipelines }
    }

    /// Encodes a segment.
    pub(crate) fn encode(&self, encoder: &mut CommandEncoder, segment: usize) {
        let is_dispatch = |command: &Command| matches!(command, Command::Dispatch { .. });
        for run in self.segments[segment].chunk_by(|a, b| is_dispatch(a) && is_dispatch(b)) {
            match run {
                [Command::Copy { from, from_offset, to, to_offset, bytes }] => {
                    let (from, to) = (&self.buffers[*from], &self.buffers[*to]);
                    encoder.copy_buffer_to_buffer(from, *from_offset, to, *to_offset, *bytes);
                }
                [Command::Clear { buffer }] => encoder.clear_buffer(&self.buffers[*buffer], 0, None),
                dispatches => self.dispatch(encoder, dispatches),
            }
        }
    }

    fn dispatch(&self, encoder: &mut CommandEncoder, commands: &[Command]) {
        let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
        for command in commands {
            if let &Command::Dispatch { pipeline, bind_group, parameters, workgroups } = command {
                pass.set_pipeline(&self.pipelines[pipeline]);
                pass.set_bind_group(0, &self.bind_groups[bind_group], &[parameters]);
                pass.dispatch_workgroups(workgroups, 1, 1);
            }
        }
    }

    /// Runs one workgroup of each of these pipelines, because some drivers compile a kernel at its first run. Call this
    /// under [`Gpu::guard`].
    pub(crate) fn warm_up(&self, gpu: &Gpu, pipelines: &[usize]) -> Result<(), Error> {
        for &wanted in pipelines {
            let first = self.segments.iter().flatten().find_map(|command| match *command {
                Command::Dispatch { pipeline, bind_group, parameters, .. } if pipeline == wanted => {
                    Some(Command::Dispatch { pipeline, bind_group, parameters, workgroups: 1 })
                }
                _ => None,
            });
            let mut encoder = encoder(gpu);
            self.dispatch(&mut encoder, first.as_slice());
            // One at a time, so that no wait lasts for the compilation of all of them.
            gpu.wait(&submit(gpu, encoder))?;
        }
        Ok(())
    }
}

/// An empty encoder.
pub(crate) fn encoder(gpu: &Gpu) -> CommandEncoder {
    gpu.device.create_command_encoder(&CommandEncoderDescriptor::default())
}

/// Submits the encoded commands.
pub(crate) fn submit(gpu: &Gpu, encoder: CommandEncoder) -> SubmissionIndex {
    gpu.queue.submit([encoder.finish()])
}
