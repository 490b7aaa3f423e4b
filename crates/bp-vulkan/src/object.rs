//! Vulkan objects with an owner. Dropping the owner destroys the object, so nothing leaks on errors.
#![expect(unsafe_code, reason = "Vulkan is a C interface")]

use std::sync::Arc;

use ash::vk;

use crate::gpu::Gpu;

/// An object of a device. It keeps the device open.
pub(crate) struct Owned<T: Destroy> {
    /// Its handle.
    pub(crate) raw: T,
    gpu: Arc<Gpu>,
}

impl<T: Destroy> Owned<T> {
    /// Takes ownership of an object that this device just made.
    pub(crate) fn new(gpu: &Arc<Gpu>, raw: T) -> Self {
        Self { raw, gpu: Arc::clone(gpu) }
    }
}

impl<T: Destroy> Drop for Owned<T> {
    fn drop(&mut self) {
        // A device that was lost or does not answer may still use the object, and waiting for it could take forever. So
        // the object stays until the process ends.
        if !self.gpu.is_abandoned() {
            // SAFETY: the device made the object and is open. The handle has no other owner. Whoever submits work waits
            // for it before dropping what it uses, or abandons the device.
            unsafe { self.raw.destroy(self.gpu.raw()) }
        }
    }
}

/// A handle of an object that can be destroyed.
pub(crate) trait Destroy: Copy {
    /// Destroys the object.
    ///
    /// # Safety
    /// The device must have made it, nothing may use it any more, and it must be destroyed only once.
    unsafe fn destroy(self, device: &ash::Device);
}

macro_rules! destroyed_by {
    ($($handle:ty: $function:ident,)*) => {$(
        impl Destroy for $handle {
            unsafe fn destroy(self, device: &ash::Device) {
                // SAFETY: the caller guarantees what the function requires.
                unsafe { device.$function(self, None) }
            }
        }
    )*};
}

destroyed_by! {
    vk::Buffer: destroy_buffer,
    vk::CommandPool: destroy_command_pool,
    vk::DescriptorPool: destroy_descriptor_pool,
    vk::DescriptorSetLayout: destroy_descriptor_set_layout,
    vk::DeviceMemory: free_memory,
    vk::Pipeline: destroy_pipeline,
    vk::PipelineCache: destroy_pipeline_cache,
    vk::PipelineLayout: destroy_pipeline_layout,
    vk::QueryPool: destroy_query_pool,
    vk::Semaphore: destroy_semaphore,
    vk::ShaderModule: destroy_shader_module,
}
