//! The buffers of a program.

use bp_core::Error;
use bp_gpu::{BindGroup, Memory, Program};
use wgpu::{
    BindGroupDescriptor, BindGroupEntry, Buffer, BufferBinding, BufferDescriptor, BufferUsages, CommandEncoder,
    MapMode, SubmissionIndex,
};

use crate::{
    gpu::Gpu,
    pipelines::{self, PARAMETER_BYTES},
};

/// Makes the buffers of a program and writes the parameters.
pub(crate) fn make(gpu: &Gpu, program: &Program) -> Result<Vec<Buffer>, Error> {
    gpu.guard(program.bytes(), || {
        let make = |buffer: &bp_gpu::Buffer| self::buffer(gpu, buffer.name, buffer.bytes, usage(buffer.memory));
        let buffers: Vec<_> = program.buffers.iter().map(make).collect();
        gpu.queue.write_buffer(&buffers[Program::PARAMETERS], 0, &program.parameters);
        Ok(buffers)
    })
}

fn usage(memory: Memory) -> BufferUsages {
    match memory {
        Memory::Device => BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST,
        Memory::Upload => BufferUsages::MAP_WRITE | BufferUsages::COPY_SRC,
        Memory::Download => BufferUsages::MAP_READ | BufferUsages::COPY_DST,
    }
}

/// Makes a buffer.
pub(crate) fn buffer(gpu: &Gpu, name: &str, bytes: u64, usage: BufferUsages) -> Buffer {
    gpu.device.create_buffer(&BufferDescriptor { label: Some(name), size: bytes, usage, mapped_at_creation: false })
}

/// Binds the parameters and a kernel's own buffers.
pub(crate) fn bind(gpu: &Gpu, group: &BindGroup, buffers: &[Buffer]) -> wgpu::BindGroup {
    let parameters = BufferBinding { buffer: &buffers[Program::PARAMETERS], offset: 0, size: PARAMETER_BYTES };
    let own = group.buffers.iter().map(|&index| buffers[index].as_entire_binding());
    let resources = std::iter::once(wgpu::BindingResource::Buffer(parameters)).chain(own);
    let entries: Vec<_> =
        (0..).zip(resources).map(|(binding, resource)| BindGroupEntry { binding, resource }).collect();
    gpu.device.create_bind_group(&BindGroupDescriptor {
        label: Some(group.kernel.name()),
        layout: &pipelines::layout(gpu, group.kernel),
        entries: &entries,
    })
}

/// Sets all buffers of [`Memory::Device`] to zeros, except the parameters.
pub(crate) fn clear(encoder: &mut CommandEncoder, program: &Program, buffers: &[Buffer]) {
    let named = program.buffers.iter().zip(buffers).skip(Program::PARAMETERS + 1);
    named.filter(|(named, _)| named.memory == Memory::Device).for_each(|(_, buffer)| {
        encoder.clear_buffer(buffer, 0, None);
    });
}

/// Writes a whole buffer of [`Memory::Upload`] after `last`, the last submission that reads it. Call this under
/// [`Gpu::guard`].
pub(crate) fn write(gpu: &Gpu, buffer: &Buffer, last: &SubmissionIndex, bytes: &[u8]) -> Result<(), Error> {
    buffer.map_async(MapMode::Write, .., |_| ());
    gpu.wait(last)?;
    let mapped = buffer.get_mapped_range_mut(..);
    mapped.map_err(|error| gpu.failed(error.to_string()))?.copy_from_slice(bytes);
    buffer.unmap();
    Ok(())
}

/// Reads a whole mappable buffer after `last`, the last submission that writes it. Call this under [`Gpu::guard`].
pub(crate) fn read<T>(
    gpu: &Gpu,
    buffer: &Buffer,
    last: &SubmissionIndex,
    read: impl FnOnce(&[u8]) -> T,
) -> Result<T, Error> {
    buffer.map_async(MapMode::Read, .., |_| ());
    gpu.wait(last)?;
    let mapped = buffer.get_mapped_range(..).map_err(|error| gpu.failed(error.to_string()))?;
    let value = read(&mapped);
    // A view must not outlive the mapping.
    drop(mapped);
    buffer.unmap();
    Ok(value)
}
