//! Compiled kernels. They live as long as their device, and are kept between runs if the driver supports that.
#![expect(unsafe_code, reason = "Vulkan is a C interface")]

use std::{
    collections::HashMap,
    ffi::CString,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use ash::vk;
use bp_core::Error;
use bp_gpu::{Kernel, Pipeline, cache};

use crate::{gpu::Gpu, object::Owned, spirv};

/// The layout of a kernel's bind groups.
pub(crate) struct Layout {
    /// The layout of its only descriptor set.
    pub(crate) set: Owned<vk::DescriptorSetLayout>,
    /// The layout of the pipeline.
    pub(crate) pipeline: Owned<vk::PipelineLayout>,
}

/// A compiled kernel.
pub(crate) struct Compiled {
    /// The pipeline.
    pub(crate) raw: Owned<vk::Pipeline>,
    /// The layout of its bind groups.
    pub(crate) layout: Arc<Layout>,
    warm: AtomicBool,
}

impl Compiled {
    /// Whether it has run. Some drivers compile a kernel at its first run.
    pub(crate) fn is_warm(&self) -> bool {
        self.warm.load(Ordering::Relaxed)
    }

    /// Records that it has run.
    pub(crate) fn set_warm(&self) {
        self.warm.store(true, Ordering::Relaxed);
    }
}

/// The kernels compiled for a device.
pub(crate) struct Pipelines {
    gpu: Arc<Gpu>,
    cache: Owned<vk::PipelineCache>,
    /// The cache as it was last stored, by this run or an earlier one.
    stored: Vec<u8>,
    layouts: HashMap<Kernel, Arc<Layout>>,
    compiled: HashMap<Pipeline, Arc<Compiled>>,
}

impl Pipelines {
    /// Starts without kernels, but with the cache stored by an earlier run.
    pub(crate) fn new(gpu: &Arc<Gpu>) -> Result<Self, Error> {
        let stored = cache::load(&cache_key(gpu)).unwrap_or_default();
        let info = vk::PipelineCacheCreateInfo::default().initial_data(&stored);
        // SAFETY: the data is empty, or it is the complete data that this driver once returned for this device.
        let cache = gpu.checked("making a pipeline cache", unsafe { gpu.raw().create_pipeline_cache(&info, None) })?;
        let cache = Owned::new(gpu, cache);
        Ok(Self { gpu: Arc::clone(gpu), cache, stored, layouts: HashMap::new(), compiled: HashMap::new() })
    }

    /// Returns these kernels, and the time spent on compiling the missing ones.
    pub(crate) fn get(&mut self, wanted: &[Pipeline]) -> Result<(Vec<Arc<Compiled>>, Duration), Error> {
        let start = Instant::now();
        let before = self.compiled.len();
        let compiled = wanted.iter().map(|pipeline| self.get_one(pipeline)).collect::<Result<_, _>>()?;
        let is_new = self.compiled.len() > before;
        Ok((compiled, if is_new { start.elapsed() } else { Duration::ZERO }))
    }

    fn get_one(&mut self, wanted: &Pipeline) -> Result<Arc<Compiled>, Error> {
        if let Some(compiled) = self.compiled.get(wanted) {
            return Ok(Arc::clone(compiled));
        }
        let layout = self.layout(wanted.kernel)?;
        let flags = vk::PipelineCreateFlags::empty();
        let raw = compile(&self.gpu, self.cache.raw, layout.pipeline.raw, wanted, flags)?;
        let compiled = Arc::new(Compiled { raw, layout, warm: AtomicBool::new(false) });
        self.compiled.insert(wanted.clone(), Arc::clone(&compiled));
        Ok(compiled)
    }

    /// The layout of a kernel's bind groups.
    pub(crate) fn layout(&mut self, kernel: Kernel) -> Result<Arc<Layout>, Error> {
        if let Some(layout) = self.layouts.get(&kernel) {
            return Ok(Arc::clone(layout));
        }
        let layout = Arc::new(lay_out(&self.gpu, kernel)?);
        self.layouts.insert(kernel, Arc::clone(&layout));
        Ok(layout)
    }

    /// Stores the driver's cache for the next run, unless it is unchanged.
    pub(crate) fn store(&mut self) {
        // SAFETY: the cache is alive, and whoever compiles has exclusive access to it.
        let data = unsafe { self.gpu.raw().get_pipeline_cache_data(self.cache.raw) }.unwrap_or_default();
        if data != self.stored {
            cache::store(&cache_key(&self.gpu), &data);
            self.stored = data;
        }
    }
}

/// The key of stored pipelines: it names the driver and the device that can load them.
fn cache_key(gpu: &Gpu) -> String {
    let vk::PhysicalDeviceProperties { vendor_id, device_id, driver_version, pipeline_cache_uuid, .. } =
        gpu.adapter.properties;
    let uuid = pipeline_cache_uuid.map(|byte| format!("{byte:02x}")).concat();
    format!("vulkan-{vendor_id:x}-{device_id:x}-{driver_version:x}-{uuid}")
}

/// The layout of a kernel's bind groups.
pub(crate) fn lay_out(gpu: &Arc<Gpu>, kernel: Kernel) -> Result<Layout, Error> {
    let binding = |(binding, kind)| {
        vk::DescriptorSetLayoutBinding::default()
            .binding(binding)
            .descriptor_type(kind)
            .descriptor_count(1)
            .stage_flags(vk::ShaderStageFlags::COMPUTE)
    };
    let buffers = kernel.bindings().iter().map(|_| vk::DescriptorType::STORAGE_BUFFER);
    let all = std::iter::once(vk::DescriptorType::STORAGE_BUFFER_DYNAMIC).chain(buffers);
    let bindings: Vec<_> = (0_u32..).zip(all).map(binding).collect();
    let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
    // SAFETY: the device is open, and the program stays within its limit of bindings.
    let set = unsafe { gpu.raw().create_descriptor_set_layout(&info, None) };
    let set = Owned::new(gpu, gpu.checked("making a descriptor set layout", set)?);
    let info = vk::PipelineLayoutCreateInfo::default().set_layouts(std::slice::from_ref(&set.raw));
    // SAFETY: the set layout belongs to the device and is alive.
    let pipeline = unsafe { gpu.raw().create_pipeline_layout(&info, None) };
    let pipeline = Owned::new(gpu, gpu.checked("making a pipeline layout", pipeline)?);
    Ok(Layout { set, pipeline })
}

/// Compiles a kernel.
pub(crate) fn compile(
    gpu: &Arc<Gpu>,
    cache: vk::PipelineCache,
    layout: vk::PipelineLayout,
    wanted: &Pipeline,
    flags: vk::PipelineCreateFlags,
) -> Result<Owned<vk::Pipeline>, Error> {
    let device = || gpu.name().to_owned();
    let words = spirv::translate(wanted).map_err(|reason| Error::Device { device: device(), reason })?;
    let info = vk::ShaderModuleCreateInfo::default().code(&words);
    // SAFETY: naga validated the module from which it wrote these words.
    let module = unsafe { gpu.raw().create_shader_module(&info, None) };
    let module = Owned::new(gpu, gpu.checked("loading a kernel", module)?);
    let name = CString::new(wanted.kernel.name()).unwrap_or_default();
    let stage = vk::PipelineShaderStageCreateInfo::default();
    let stage = stage.stage(vk::ShaderStageFlags::COMPUTE).module(module.raw).name(&name);
    let info = vk::ComputePipelineCreateInfo::default().stage(stage).layout(layout).flags(flags);
    // SAFETY: the layout matches what the module declares. Both belong to the device and are alive. Whoever compiles
    // has exclusive access to the cache.
    let made = unsafe { gpu.raw().create_compute_pipelines(cache, &[info], None) };
    let made = made.map_err(|(_, result)| result);
    let pipelines = gpu.checked("compiling a kernel", made)?;
    Ok(Owned::new(gpu, pipelines[0]))
}
