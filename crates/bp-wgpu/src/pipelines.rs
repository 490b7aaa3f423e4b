//! The pipelines of a device. Each is compiled once and shared by all plans.

use std::{
    collections::HashMap,
    sync::{Mutex, PoisonError},
};

use bp_core::Error;
use bp_gpu::{Access, Kernel, Pipeline, Program, cache};
use wgpu::{
    Adapter, BindGroupLayout, BindGroupLayoutDescriptor, BindGroupLayoutEntry, BindingType, BufferBindingType,
    BufferSize, ComputePipeline, ComputePipelineDescriptor, Features, PipelineCache, PipelineCacheDescriptor,
    PipelineCompilationOptions, PipelineLayoutDescriptor, ShaderModuleDescriptor, ShaderRuntimeChecks, ShaderSource,
    ShaderStages,
};

use crate::{gpu::Gpu, vulkan};

/// The size of the binding for a block of parameters.
pub(crate) const PARAMETER_BYTES: Option<BufferSize> = BufferSize::new(Program::PARAMETER_BYTES);

/// All pipelines made so far.
pub(crate) struct Pipelines {
    made: Mutex<HashMap<Pipeline, ComputePipeline>>,
    cache: Option<Cache>,
}

/// The driver's cache of compiled pipelines, kept between runs.
struct Cache {
    key: String,
    pipelines: PipelineCache,
    /// The cache as it was last stored.
    stored: Mutex<Vec<u8>>,
}

impl Pipelines {
    /// Starts without pipelines, but with the cache of earlier runs.
    pub(crate) fn new(gpu: &Gpu, adapter: &Adapter) -> Result<Self, Error> {
        Ok(Self { made: Mutex::default(), cache: gpu.guard(0, || Ok(load(gpu, adapter)))? })
    }

    /// Returns a pipeline, and whether it was compiled just now.
    pub(crate) fn get(&self, gpu: &Gpu, pipeline: &Pipeline) -> Result<(ComputePipeline, bool), Error> {
        let mut made = self.made.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = made.get(pipeline) {
            return Ok((known.clone(), false));
        }
        let cache = self.cache.as_ref().map(|cache| &cache.pipelines);
        let new = gpu.guard(0, || Ok(compile(gpu, pipeline, cache)))?;
        made.insert(pipeline.clone(), new.clone());
        Ok((new, true))
    }

    /// Stores the cache for later runs, unless it is unchanged.
    pub(crate) fn store(&self) {
        let Some(cache) = &self.cache else { return };
        let Some(data) = cache.pipelines.get_data() else { return };
        let mut stored = cache.stored.lock().unwrap_or_else(PoisonError::into_inner);
        if *stored != data {
            cache::store(&cache.key, &data);
            *stored = data;
        }
    }
}

fn load(gpu: &Gpu, adapter: &Adapter) -> Option<Cache> {
    if !gpu.device.features().contains(Features::PIPELINE_CACHE) {
        return None;
    }
    let key = vulkan::cache_key(adapter)?;
    let stored = cache::load(&key);
    match made(gpu, stored.as_deref()) {
        Ok(pipelines) => Some(Cache { key, pipelines, stored: Mutex::new(stored.unwrap_or_default()) }),
        // To wgpu, data of another device are an error and no reason to begin anew.
        Err(_) => Some(Cache { key, pipelines: made(gpu, None).ok()?, stored: Mutex::default() }),
    }
}

#[expect(unsafe_code, reason = "wgpu cannot check what a driver wrote")]
fn made(gpu: &Gpu, data: Option<&[u8]>) -> Result<PipelineCache, Error> {
    let descriptor = PipelineCacheDescriptor { label: None, data, fallback: true };
    // SAFETY: only `Pipelines::store` stores data under this key: all of what `PipelineCache::get_data` returned.
    // `cache::load` has compared its SHA-256 sum. wgpu itself refuses data of another device or driver.
    gpu.guard(0, || Ok(unsafe { gpu.device.create_pipeline_cache(&descriptor) }))
}

#[expect(unsafe_code, reason = "wgpu's checks of loops and indices cost time")]
fn compile(gpu: &Gpu, pipeline: &Pipeline, cache: Option<&PipelineCache>) -> ComputePipeline {
    let label = pipeline.to_string();
    let source = ShaderSource::Wgsl(pipeline.kernel.source().into());
    let descriptor = ShaderModuleDescriptor { label: Some(&label), source };
    // Without wgpu's checks, which cost an H100 half as much time again.
    // SAFETY: the loops of kernels end, and their indices stay within the buffers.
    let module = unsafe { gpu.device.create_shader_module_trusted(descriptor, ShaderRuntimeChecks::unchecked()) };
    let layout = gpu.device.create_pipeline_layout(&PipelineLayoutDescriptor {
        label: Some(&label),
        bind_group_layouts: &[Some(&layout(gpu, pipeline.kernel))],
        immediate_size: 0,
    });
    let constants: Vec<_> = pipeline.constants.iter().map(|&(name, value)| (name, f64::from(value))).collect();
    gpu.device.create_compute_pipeline(&ComputePipelineDescriptor {
        label: Some(&label),
        layout: Some(&layout),
        module: &module,
        entry_point: Some(pipeline.kernel.name()),
        compilation_options: PipelineCompilationOptions {
            constants: &constants,
            // Kernels write what they read.
            zero_initialize_workgroup_memory: false,
        },
        cache,
    })
}

/// The layout of a kernel's buffers. wgpu treats equal layouts as the same one.
pub(crate) fn layout(gpu: &Gpu, kernel: Kernel) -> BindGroupLayout {
    let parameters = BindingType::Buffer {
        ty: BufferBindingType::Storage { read_only: true },
        has_dynamic_offset: true,
        min_binding_size: PARAMETER_BYTES,
    };
    let own = kernel.bindings().iter().map(|&access| BindingType::Buffer {
        ty: BufferBindingType::Storage { read_only: access == Access::Read },
        has_dynamic_offset: false,
        min_binding_size: None,
    });
    let entry = |(binding, ty)| BindGroupLayoutEntry { binding, visibility: ShaderStages::COMPUTE, ty, count: None };
    let entries: Vec<_> = (0..).zip(std::iter::once(parameters).chain(own)).map(entry).collect();
    gpu.device.create_bind_group_layout(&BindGroupLayoutDescriptor { label: Some(kernel.name()), entries: &entries })
}
