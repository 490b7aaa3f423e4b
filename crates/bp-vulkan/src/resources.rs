//! The resources of a program: its buffers, bind groups and pipelines.
#![expect(unsafe_code, reason = "Vulkan is a C interface")]

use std::{
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

use ash::vk;
use bp_core::Error;
use bp_gpu::{BindGroup, Program};

use crate::{
    buffers::Buffers,
    gpu::Gpu,
    object::Owned,
    pipelines::{Compiled, Layout, Pipelines},
};

/// The resources, with the same indices as in the program.
pub(crate) struct Resources {
    /// The compiled kernels.
    pub(crate) pipelines: Vec<Arc<Compiled>>,
    /// A descriptor set for every bind group. They exist as long as their pool.
    pub(crate) sets: Vec<vk::DescriptorSet>,
    _pool: Owned<vk::DescriptorPool>,
    /// The buffers.
    pub(crate) buffers: Buffers,
}

impl Resources {
    /// Allocates first, to fail early, then compiles the missing kernels. Also returns the time spent on compiling.
    pub(crate) fn new(
        gpu: &Arc<Gpu>,
        pipelines: &Mutex<Pipelines>,
        program: &Program,
    ) -> Result<(Self, Duration), Error> {
        let buffers = Buffers::new(gpu, &program.buffers)?;
        let mut pipelines = pipelines.lock().unwrap_or_else(PoisonError::into_inner);
        let layouts = program.bind_groups.iter().map(|group| pipelines.layout(group.kernel));
        let layouts = layouts.collect::<Result<Vec<_>, _>>()?;
        let pool = make_pool(gpu, &program.bind_groups)?;
        let sets = make_sets(gpu, pool.raw, &layouts)?;
        for (group, &set) in program.bind_groups.iter().zip(&sets) {
            bind(gpu, &buffers, group, set);
        }
        let (pipelines, time) = pipelines.get(&program.pipelines)?;
        Ok((Self { pipelines, sets, _pool: pool, buffers }, time))
    }
}

fn make_pool(gpu: &Arc<Gpu>, groups: &[BindGroup]) -> Result<Owned<vk::DescriptorPool>, Error> {
    let buffers = groups.iter().map(|group| group.buffers.len()).sum::<usize>();
    let size = |kind, count: usize| vk::DescriptorPoolSize { ty: kind, descriptor_count: count.max(1) as u32 };
    let sizes = [
        size(vk::DescriptorType::STORAGE_BUFFER_DYNAMIC, groups.len()),
        size(vk::DescriptorType::STORAGE_BUFFER, buffers),
    ];
    let info = vk::DescriptorPoolCreateInfo::default().max_sets(groups.len().max(1) as u32).pool_sizes(&sizes);
    // SAFETY: the device is open.
    let pool = unsafe { gpu.raw().create_descriptor_pool(&info, None) };
    Ok(Owned::new(gpu, gpu.checked("making a descriptor pool", pool)?))
}

fn make_sets(gpu: &Gpu, pool: vk::DescriptorPool, layouts: &[Arc<Layout>]) -> Result<Vec<vk::DescriptorSet>, Error> {
    if layouts.is_empty() {
        return Ok(Vec::new());
    }
    let layouts: Vec<_> = layouts.iter().map(|layout| layout.set.raw).collect();
    let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts);
    // SAFETY: the pool and the layouts belong to the device, and the pool has room for the sets of these layouts.
    gpu.checked("making descriptor sets", unsafe { gpu.raw().allocate_descriptor_sets(&info) })
}

/// Binds one block of the parameters and the buffers of a bind group to a set.
fn bind(gpu: &Gpu, buffers: &Buffers, group: &BindGroup, set: vk::DescriptorSet) {
    let whole =
        |&buffer: &usize| vk::DescriptorBufferInfo { buffer: buffers.raw(buffer), offset: 0, range: vk::WHOLE_SIZE };
    let block = vk::DescriptorBufferInfo { range: Program::PARAMETER_BYTES, ..whole(&Program::PARAMETERS) };
    let others: Vec<_> = group.buffers.iter().map(whole).collect();
    let write = vk::WriteDescriptorSet::default().dst_set(set);
    let writes = [
        write.descriptor_type(vk::DescriptorType::STORAGE_BUFFER_DYNAMIC).buffer_info(std::slice::from_ref(&block)),
        // Continues from binding to binding, because each has one descriptor of the same kind.
        write.dst_binding(1).descriptor_type(vk::DescriptorType::STORAGE_BUFFER).buffer_info(&others),
    ];
    // SAFETY: the set has this many bindings of these kinds, and no work uses it yet.
    unsafe { gpu.raw().update_descriptor_sets(&writes, &[]) }
}
