//! Allocates command buffers and records commands into them.
#![expect(unsafe_code, reason = "Vulkan is a C interface")]

use std::sync::Arc;

use ash::vk;
use bp_core::Error;
use bp_gpu::{Command, Memory, Program};

use crate::{gpu::Gpu, object::Owned, resources::Resources};

/// The most bytes of data that a single command can carry to a buffer.
const CARRIED_BYTES: usize = 65_536;

/// Command buffers.
pub(crate) struct Commands {
    pool: Owned<vk::CommandPool>,
    gpu: Arc<Gpu>,
}

impl Commands {
    /// Starts without command buffers.
    pub(crate) fn new(gpu: &Arc<Gpu>) -> Result<Self, Error> {
        let flags = vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER;
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(gpu.family).flags(flags);
        // SAFETY: the device is open and has a queue of this family.
        let pool = gpu.checked("making a command pool", unsafe { gpu.raw().create_command_pool(&info, None) })?;
        Ok(Self { pool: Owned::new(gpu, pool), gpu: Arc::clone(gpu) })
    }

    /// Makes an empty command buffer that lives as long as the pool.
    pub(crate) fn make(&mut self) -> Result<vk::CommandBuffer, Error> {
        let info = vk::CommandBufferAllocateInfo::default().command_pool(self.pool.raw).command_buffer_count(1);
        // SAFETY: the pool belongs to the device and is alive.
        let made = unsafe { self.gpu.raw().allocate_command_buffers(&info) };
        Ok(self.gpu.checked("making a command buffer", made)?[0])
    }

    /// Records a command buffer of this pool, which the device must not be using. It can then be submitted many times.
    pub(crate) fn record(
        &mut self,
        commands: vk::CommandBuffer,
        record: impl FnOnce(&Recorder<'_>),
    ) -> Result<(), Error> {
        let flags = vk::CommandBufferUsageFlags::SIMULTANEOUS_USE;
        let info = vk::CommandBufferBeginInfo::default().flags(flags);
        // SAFETY: the command buffer belongs to this pool, which nobody else uses, and is not in use.
        let begun = unsafe { self.gpu.raw().begin_command_buffer(commands, &info) };
        self.gpu.checked("recording", begun)?;
        record(&Recorder { gpu: &self.gpu, commands });
        // SAFETY: it was begun above.
        self.gpu.checked("recording", unsafe { self.gpu.raw().end_command_buffer(commands) })
    }
}

/// A command buffer that is being recorded. Its functions rely on this, and on the resources that they name: these must
/// exist until the commands have run for the last time. The owner of the command buffers also owns the resources.
pub(crate) struct Recorder<'a> {
    gpu: &'a Gpu,
    commands: vk::CommandBuffer,
}

impl Recorder<'_> {
    /// Records a segment. It sees all earlier writes, and the host sees its copies.
    pub(crate) fn segment(&self, resources: &Resources, commands: &[Command]) {
        self.barrier();
        for command in commands {
            self.command(resources, command);
        }
        let download = |command: &Command| matches!(command, Command::Copy { to, .. } if *to == Program::DOWNLOAD);
        if commands.iter().any(download) {
            self.show_host();
        }
    }

    /// Records a command.
    pub(crate) fn command(&self, resources: &Resources, command: &Command) {
        match *command {
            Command::Dispatch { pipeline, bind_group, parameters, workgroups } => {
                self.dispatch(resources, (pipeline, bind_group), parameters, workgroups);
            }
            Command::Copy { from, from_offset, to, to_offset, bytes } => {
                let region = vk::BufferCopy { src_offset: from_offset, dst_offset: to_offset, size: bytes };
                self.copy(resources.buffers.raw(from), resources.buffers.raw(to), region);
            }
            Command::Clear { buffer } => self.clear(resources.buffers.raw(buffer)),
            Command::Barrier => self.barrier(),
        }
    }

    fn dispatch(
        &self,
        resources: &Resources,
        (pipeline, bind_group): (usize, usize),
        parameters: u32,
        workgroups: u32,
    ) {
        let (raw, point) = (self.gpu.raw(), vk::PipelineBindPoint::COMPUTE);
        let (pipeline, sets) = (&resources.pipelines[pipeline], &resources.sets[bind_group..=bind_group]);
        let layout = pipeline.layout.pipeline.raw;
        // SAFETY: the set has the pipeline's layout, and the program keeps the offset and the number of workgroups
        // within the limits.
        unsafe {
            raw.cmd_bind_pipeline(self.commands, point, pipeline.raw.raw);
            raw.cmd_bind_descriptor_sets(self.commands, point, layout, 0, sets, &[parameters]);
            raw.cmd_dispatch(self.commands, workgroups, 1, 1);
        }
    }

    /// Copies between buffers.
    pub(crate) fn copy(&self, from: vk::Buffer, to: vk::Buffer, region: vk::BufferCopy) {
        // SAFETY: all buffers can be copied from and to. The region lies within both and does not overlap itself.
        unsafe { self.gpu.raw().cmd_copy_buffer(self.commands, from, to, &[region]) }
    }

    fn clear(&self, buffer: vk::Buffer) {
        // SAFETY: all buffers can be copied to, and their sizes are multiples of 4.
        unsafe { self.gpu.raw().cmd_fill_buffer(self.commands, buffer, 0, vk::WHOLE_SIZE, 0) }
    }

    /// Clears all buffers on the device and writes the parameters. Later commands see both.
    pub(crate) fn start(&self, resources: &Resources, parameters: &[u8]) {
        self.barrier();
        for buffer in resources.buffers.of(Memory::Device).filter(|&buffer| buffer != Program::PARAMETERS) {
            self.clear(resources.buffers.raw(buffer));
        }
        let to = resources.buffers.raw(Program::PARAMETERS);
        for (data, offset) in parameters.chunks(CARRIED_BYTES).zip((0..).step_by(CARRIED_BYTES)) {
            // SAFETY: the buffer is as large as the parameters, whose blocks have sizes that are multiples of 4.
            unsafe { self.gpu.raw().cmd_update_buffer(self.commands, to, offset, data) }
        }
        self.barrier();
    }

    /// Makes all earlier writes, in this command buffer and in those before it, visible to later kernels and copies.
    pub(crate) fn barrier(&self) {
        let stages = vk::PipelineStageFlags::COMPUTE_SHADER | vk::PipelineStageFlags::TRANSFER;
        let written = vk::AccessFlags::SHADER_WRITE | vk::AccessFlags::TRANSFER_WRITE;
        let used = written | vk::AccessFlags::SHADER_READ | vk::AccessFlags::TRANSFER_READ;
        self.dependency((stages, written), (stages, used));
    }

    /// Makes copied data visible to the host after it has waited.
    pub(crate) fn show_host(&self) {
        let copied = (vk::PipelineStageFlags::TRANSFER, vk::AccessFlags::TRANSFER_WRITE);
        self.dependency(copied, (vk::PipelineStageFlags::HOST, vk::AccessFlags::HOST_READ));
    }

    fn dependency(
        &self,
        before: (vk::PipelineStageFlags, vk::AccessFlags),
        after: (vk::PipelineStageFlags, vk::AccessFlags),
    ) {
        let barrier = [vk::MemoryBarrier::default().src_access_mask(before.1).dst_access_mask(after.1)];
        let none = vk::DependencyFlags::empty();
        // SAFETY: the queue supports compute, so it supports these stages.
        unsafe { self.gpu.raw().cmd_pipeline_barrier(self.commands, before.0, after.0, none, &barrier, &[], &[]) }
    }

    /// Writes a timestamp when everything before it is done.
    pub(crate) fn timestamp(&self, queries: vk::QueryPool, query: u32) {
        let end = vk::PipelineStageFlags::BOTTOM_OF_PIPE;
        // SAFETY: the pool contains the query, and the queue supports timestamps.
        unsafe {
            self.gpu.raw().cmd_reset_query_pool(self.commands, queries, query, 1);
            self.gpu.raw().cmd_write_timestamp(self.commands, end, queries, query);
        }
    }
}
