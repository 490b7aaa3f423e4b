//! Properties of a device that wgpu does not report. They come from the Vulkan driver behind it.
#![expect(unsafe_code, reason = "Vulkan is a C interface")]

use std::ops::Deref;

use ash::{Entry, ext, vk};
use uuid::Uuid;
use wgpu::{
    Adapter,
    hal::{self, api::Vulkan},
};

/// Whether there is a Vulkan loader.
pub(crate) fn has_loader() -> bool {
    // SAFETY: a Vulkan loader may be loaded at any time, and nothing else is loaded under its name.
    unsafe { Entry::load() }.is_ok()
}

/// The API description of a device: its Vulkan version, through wgpu.
pub(crate) fn api(adapter: &Adapter) -> Option<String> {
    let version = properties(adapter)?.api_version;
    let (major, minor) = (vk::api_version_major(version), vk::api_version_minor(version));
    Some(format!("Vulkan {major}.{minor}.{} through wgpu", vk::api_version_patch(version)))
}

/// The device's UUID.
pub(crate) fn uuid(adapter: &Adapter) -> Option<String> {
    let hal = raw(adapter).filter(|hal| answers_more(hal))?;
    let mut id = vk::PhysicalDeviceIDProperties::default();
    let mut both = vk::PhysicalDeviceProperties2::default().push_next(&mut id);
    let instance = hal.shared_instance().raw_instance();
    // SAFETY: the device belongs to this instance, and both support Vulkan 1.1, which includes the structure.
    unsafe { instance.get_physical_device_properties2(hal.raw_physical_device(), &mut both) };
    Some(Uuid::from_bytes(id.device_uuid).to_string())
}

/// The key of stored pipelines: it names the driver and the device that can load them.
pub(crate) fn cache_key(adapter: &Adapter) -> Option<String> {
    let vk::PhysicalDeviceProperties { vendor_id, device_id, driver_version, pipeline_cache_uuid, .. } =
        properties(adapter)?;
    let uuid = pipeline_cache_uuid.map(|byte| format!("{byte:02x}")).concat();
    Some(format!("wgpu-{vendor_id:x}-{device_id:x}-{driver_version:x}-{uuid}"))
}

/// The bytes of the heap that holds buffers on the device.
pub(crate) fn memory_bytes(adapter: &Adapter) -> Option<u64> {
    let memory = memory(&*raw(adapter)?);
    Some(memory.memory_heaps[device_heap(&memory)?].size)
}

/// The bytes of that heap that are still free for this process, if the driver reports them.
pub(crate) fn free_bytes(adapter: &Adapter) -> Option<u64> {
    let hal = raw(adapter).filter(|hal| answers_more(hal))?;
    if !hal.physical_device_capabilities().supports_extension(ext::memory_budget::NAME) {
        return None;
    }
    let heap = device_heap(&memory(&hal))?;
    let mut budget = vk::PhysicalDeviceMemoryBudgetPropertiesEXT::default();
    let mut both = vk::PhysicalDeviceMemoryProperties2::default().push_next(&mut budget);
    let instance = hal.shared_instance().raw_instance();
    // SAFETY: the device belongs to this instance, both support Vulkan 1.1, and the device has the extension.
    unsafe { instance.get_physical_device_memory_properties2(hal.raw_physical_device(), &mut both) };
    Some(budget.heap_budget[heap].saturating_sub(budget.heap_usage[heap]))
}

/// The Vulkan side of an adapter.
fn raw(adapter: &Adapter) -> Option<impl Deref<Target = hal::vulkan::Adapter>> {
    // SAFETY: this module only queries the adapter and destroys nothing.
    unsafe { adapter.as_hal::<Vulkan>() }
}

fn properties(adapter: &Adapter) -> Option<vk::PhysicalDeviceProperties> {
    Some(raw(adapter)?.physical_device_capabilities().properties())
}

/// Whether instance and device support Vulkan 1.1 or later. Earlier versions cannot answer extended queries.
fn answers_more(hal: &hal::vulkan::Adapter) -> bool {
    let device = hal.physical_device_capabilities().properties().api_version;
    hal.shared_instance().instance_api_version().min(device) >= vk::API_VERSION_1_1
}

fn memory(hal: &hal::vulkan::Adapter) -> vk::PhysicalDeviceMemoryProperties {
    let instance = hal.shared_instance().raw_instance();
    // SAFETY: the device belongs to this instance.
    unsafe { instance.get_physical_device_memory_properties(hal.raw_physical_device()) }
}

/// The heap that wgpu uses for buffers on the device: that of the first device-local type of memory.
fn device_heap(memory: &vk::PhysicalDeviceMemoryProperties) -> Option<usize> {
    let types = memory.memory_types_as_slice();
    let local = types.iter().find(|kind| kind.property_flags.contains(vk::MemoryPropertyFlags::DEVICE_LOCAL));
    local.or(types.first()).map(|kind| kind.heap_index as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_heap_is_the_one_of_the_first_local_memory() {
        let (host, local) = (vk::MemoryPropertyFlags::HOST_VISIBLE, vk::MemoryPropertyFlags::DEVICE_LOCAL);
        let heap = |types: &[(vk::MemoryPropertyFlags, u32)]| {
            let memory_type_count = types.len() as u32;
            let mut memory = vk::PhysicalDeviceMemoryProperties { memory_type_count, ..Default::default() };
            for (to, &(property_flags, heap_index)) in memory.memory_types.iter_mut().zip(types) {
                *to = vk::MemoryType { property_flags, heap_index };
            }
            device_heap(&memory)
        };
        // The last one is the small window through which the host sees a GPU's memory.
        assert_eq!(heap(&[(host, 1), (local, 0), (local | host, 2)]), Some(0));
        assert_eq!(heap(&[(host, 1)]), Some(1));
        assert_eq!(heap(&[]), None);
    }
}
