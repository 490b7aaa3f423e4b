//! The limits of a device.

use bp_gpu::{Limits, Shape};

use crate::{gpu::Gpu, memory::device_heap};

/// The limits of a device. The error is the reason as text why there are none.
pub(crate) fn of(gpu: &Gpu) -> Result<Limits, String> {
    let limits = &gpu.adapter.properties.limits;
    let bindings = [
        limits.max_per_stage_descriptor_storage_buffers,
        limits.max_descriptor_set_storage_buffers,
        limits.max_per_stage_resources,
    ];
    Ok(Limits {
        device: gpu.name().to_owned(),
        binding_bytes: u64::from(limits.max_storage_buffer_range).min(gpu.most_bytes.buffer),
        buffer_bytes: gpu.most_bytes.buffer,
        bindings: bindings.into_iter().min().unwrap_or(0),
        workgroups: limits.max_compute_work_group_count[0],
        invocations: limits.max_compute_work_group_invocations,
        memory_bytes: device_heap(&gpu.memory).map(|heap| gpu.memory.memory_heaps[heap].size),
        shape: Shape::of(gpu.adapter.info.kind)?,
        dispatch_entries: Limits::dispatch_entries(gpu.adapter.info.kind),
    })
}

/// The bytes of device memory that are free now, if the driver reports them.
pub(crate) fn free_bytes(gpu: &Gpu) -> Option<u64> {
    gpu.adapter.free_bytes(gpu.instance().raw(), device_heap(&gpu.memory)?)
}
