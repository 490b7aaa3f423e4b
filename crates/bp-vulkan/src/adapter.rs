//! The devices that the drivers provide.
#![expect(unsafe_code, reason = "Vulkan is a C interface")]

use std::ffi::CStr;

use ash::{ext, khr, vk};
use bp_core::{DeviceInfo, DeviceKind};
use uuid::Uuid;

use crate::memory;

/// A device that a driver provides.
#[derive(Clone)]
pub(crate) struct Adapter {
    /// Its handle, which is valid as long as the instance.
    pub(crate) raw: vk::PhysicalDevice,
    /// Its description for users.
    pub(crate) info: DeviceInfo,
    /// Its properties, as its driver reports them.
    pub(crate) properties: vk::PhysicalDeviceProperties,
}

/// The size limits of a device, in bytes.
#[derive(Clone, Copy)]
pub(crate) struct MostBytes {
    /// One allocation.
    pub(crate) allocation: u64,
    /// One buffer, which lies in one allocation.
    pub(crate) buffer: u64,
}

impl Adapter {
    /// Describes a device of this instance.
    pub(crate) fn of(instance: &ash::Instance, raw: vk::PhysicalDevice) -> Self {
        // SAFETY: the device belongs to this instance.
        let properties = unsafe { instance.get_physical_device_properties(raw) };
        // SAFETY: the same.
        let memory = unsafe { instance.get_physical_device_memory_properties(raw) };
        let kind = kind(properties.device_type);
        let shared = kind == DeviceKind::SoftwareRasteriser;
        let heap = memory::device_heap(&memory).filter(|_| !shared);
        let mut info = DeviceInfo {
            name: text(properties.device_name_as_c_str()),
            kind,
            api: Some(format!("Vulkan {}", version_text(properties.api_version))),
            driver: None,
            memory_bytes: heap.map(|heap| memory.memory_heaps[heap].size),
            uuid: None,
            workers: 1,
        };
        if properties.api_version >= vk::API_VERSION_1_2 {
            (info.driver, info.uuid) = driver_and_uuid(instance, raw);
        }
        Self { raw, info, properties }
    }

    /// Whether it has an extension.
    pub(crate) fn has_extension(&self, instance: &ash::Instance, name: &CStr) -> bool {
        has_extension(instance, self.raw, name)
    }

    /// The size limits of a device that supports Vulkan 1.2.
    pub(crate) fn most_bytes(&self, instance: &ash::Instance) -> MostBytes {
        let mut allocation = vk::PhysicalDeviceMaintenance3Properties::default();
        let mut buffer = vk::PhysicalDeviceMaintenance4Properties::default();
        let mut both = vk::PhysicalDeviceProperties2::default().push_next(&mut allocation);
        let tells_buffers = self.properties.api_version >= vk::API_VERSION_1_3
            || has_extension(instance, self.raw, khr::maintenance4::NAME);
        if tells_buffers {
            both = both.push_next(&mut buffer);
        }
        // SAFETY: the device belongs to this instance and supports these structures: the first is part of Vulkan 1.1,
        // and support for the second was checked above.
        unsafe { instance.get_physical_device_properties2(self.raw, &mut both) };
        let allocation = allocation.max_memory_allocation_size;
        MostBytes {
            allocation,
            buffer: if tells_buffers { buffer.max_buffer_size.min(allocation) } else { allocation },
        }
    }

    /// The bytes of a heap that are still free for this process, if its driver reports them.
    pub(crate) fn free_bytes(&self, instance: &ash::Instance, heap: usize) -> Option<u64> {
        if !has_extension(instance, self.raw, ext::memory_budget::NAME) {
            return None;
        }
        let mut budget = vk::PhysicalDeviceMemoryBudgetPropertiesEXT::default();
        let mut memory = vk::PhysicalDeviceMemoryProperties2::default().push_next(&mut budget);
        // SAFETY: the device belongs to this instance and has the extension that defines the structure.
        unsafe { instance.get_physical_device_memory_properties2(self.raw, &mut memory) };
        Some(budget.heap_budget[heap].saturating_sub(budget.heap_usage[heap]))
    }
}

/// The driver and the UUID of a device that supports Vulkan 1.2.
fn driver_and_uuid(instance: &ash::Instance, raw: vk::PhysicalDevice) -> (Option<String>, Option<String>) {
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    let mut id = vk::PhysicalDeviceIDProperties::default();
    let mut both = vk::PhysicalDeviceProperties2::default().push_next(&mut driver).push_next(&mut id);
    // SAFETY: the device belongs to this instance and supports Vulkan 1.2, which includes these structures.
    unsafe { instance.get_physical_device_properties2(raw, &mut both) };
    let version = version_text(both.properties.driver_version);
    let (name, mut told) = (text(driver.driver_name_as_c_str()), text(driver.driver_info_as_c_str()));
    if told.is_empty() {
        told = version;
    }
    (Some(format!("{name} {told}")), Some(Uuid::from_bytes(id.device_uuid).to_string()))
}

/// Whether a device has an extension.
fn has_extension(instance: &ash::Instance, device: vk::PhysicalDevice, name: &CStr) -> bool {
    // SAFETY: the device belongs to this instance.
    let extensions = unsafe { instance.enumerate_device_extension_properties(device) }.unwrap_or_default();
    extensions.iter().any(|extension| extension.extension_name_as_c_str() == Ok(name))
}

fn kind(device_type: vk::PhysicalDeviceType) -> DeviceKind {
    match device_type {
        vk::PhysicalDeviceType::DISCRETE_GPU => DeviceKind::DiscreteGpu,
        vk::PhysicalDeviceType::INTEGRATED_GPU => DeviceKind::IntegratedGpu,
        vk::PhysicalDeviceType::VIRTUAL_GPU => DeviceKind::VirtualGpu,
        vk::PhysicalDeviceType::CPU => DeviceKind::SoftwareRasteriser,
        _ => DeviceKind::Other,
    }
}

/// A text from a driver.
pub(crate) fn text<E>(text: Result<&CStr, E>) -> String {
    text.map_or_else(|_| String::new(), |text| text.to_string_lossy().into_owned())
}

/// Formats a version that Vulkan packed into a number.
pub(crate) fn version_text(version: u32) -> String {
    let (major, minor) = (vk::api_version_major(version), vk::api_version_minor(version));
    format!("{major}.{minor}.{}", vk::api_version_patch(version))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_are_written_as_usual() {
        assert_eq!(version_text(vk::make_api_version(0, 1, 3, 230)), "1.3.230");
    }
}
