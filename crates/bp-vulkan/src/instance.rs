//! The loader, the connection to the drivers, and the devices they offer.
#![expect(unsafe_code, reason = "Vulkan is a C interface")]

use std::{ffi::CStr, sync::LazyLock};

use ash::{Entry, ext, khr, vk};
use bp_core::{DeviceInfo, DeviceKind};
use bp_gpu::missing;
use uuid::Uuid;

use crate::{limits, validation};

/// The loader. It stays loaded to the end: drivers may leave code behind that threads run when they end.
static ENTRY: LazyLock<Result<Entry, String>> = LazyLock::new(|| {
    // SAFETY: a Vulkan loader may be loaded at any time; nothing else is loaded under its name.
    unsafe { Entry::load() }.map_err(|error| format!("{} ({error})", missing::loader()))
});

/// The loader, or why there is none.
pub(crate) fn entry() -> Result<&'static Entry, String> {
    ENTRY.as_ref().map_err(Clone::clone)
}

/// A connection to the drivers.
pub(crate) struct Instance {
    raw: ash::Instance,
    /// Hears what the validation layer complains of.
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
}

/// A device that a driver offers.
#[derive(Clone)]
pub(crate) struct Adapter {
    /// Its handle, valid as long as the instance.
    pub(crate) raw: vk::PhysicalDevice,
    /// What users are told of it.
    pub(crate) info: DeviceInfo,
    /// What its driver says of it.
    pub(crate) properties: vk::PhysicalDeviceProperties,
}

/// How large things may be, in bytes.
#[derive(Clone, Copy)]
pub(crate) struct MostBytes {
    /// One allocation.
    pub(crate) allocation: u64,
    /// One buffer, which lies in one allocation.
    pub(crate) buffer: u64,
}

impl Instance {
    /// Connects to the drivers; else the reason why that cannot be.
    pub(crate) fn new() -> Result<Self, String> {
        let entry = entry()?;
        // SAFETY: the loader allows the call at any time.
        let version = unsafe { entry.try_enumerate_instance_version() }.ok().flatten();
        if version.is_none_or(|version| version < vk::API_VERSION_1_2) {
            return Err("the Vulkan loader, libvulkan.so.1, is older than Vulkan 1.2".to_owned());
        }
        let validated = validation::is_on(entry);
        let mut instance = Self { raw: create(entry, validated)?, messenger: None };
        if validated {
            let listeners = ext::debug_utils::Instance::new(entry, &instance.raw);
            // SAFETY: the instance was made with the extension.
            let messenger = unsafe { listeners.create_debug_utils_messenger(&validation::listener(), None) };
            instance.messenger = messenger.ok().map(|messenger| (listeners, messenger));
        }
        Ok(instance)
    }

    /// The functions of the instance.
    pub(crate) fn raw(&self) -> &ash::Instance {
        &self.raw
    }

    /// The devices there are, those expected to be fastest first, else as their drivers sort them.
    pub(crate) fn adapters(&self) -> Result<Vec<Adapter>, String> {
        // SAFETY: the instance is alive.
        let devices = unsafe { self.raw.enumerate_physical_devices() };
        let devices = devices.map_err(|error| {
            format!(
                "the Vulkan drivers list no devices: {error}; memory may be short, or a driver without its hardware"
            )
        })?;
        let mut adapters: Vec<_> = devices.into_iter().map(|device| self.adapter(device)).collect();
        adapters.sort_by_key(|adapter| adapter.info.kind);
        if adapters.is_empty() { Err(missing::driver()) } else { Ok(adapters) }
    }

    fn adapter(&self, raw: vk::PhysicalDevice) -> Adapter {
        // SAFETY: the device is one of this instance's.
        let properties = unsafe { self.raw.get_physical_device_properties(raw) };
        // SAFETY: the same.
        let memory = unsafe { self.raw.get_physical_device_memory_properties(raw) };
        let kind = kind(properties.device_type);
        let shared = kind == DeviceKind::SoftwareRasteriser;
        let heap = limits::device_heap(&memory).filter(|_| !shared);
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
            (info.driver, info.uuid) = self.driver_and_uuid(raw);
        }
        Adapter { raw, info, properties }
    }

    /// What devices tell since Vulkan 1.2.
    fn driver_and_uuid(&self, raw: vk::PhysicalDevice) -> (Option<String>, Option<String>) {
        let mut driver = vk::PhysicalDeviceDriverProperties::default();
        let mut id = vk::PhysicalDeviceIDProperties::default();
        let mut both = vk::PhysicalDeviceProperties2::default().push_next(&mut driver).push_next(&mut id);
        // SAFETY: the device is one of this instance's and has Vulkan 1.2, of which these structures are.
        unsafe { self.raw.get_physical_device_properties2(raw, &mut both) };
        let version = version_text(both.properties.driver_version);
        let (name, mut told) = (text(driver.driver_name_as_c_str()), text(driver.driver_info_as_c_str()));
        if told.is_empty() {
            told = version;
        }
        (Some(format!("{name} {told}")), Some(Uuid::from_bytes(id.device_uuid).to_string()))
    }

    /// Whether a device has an extension.
    pub(crate) fn has_extension(&self, device: vk::PhysicalDevice, name: &CStr) -> bool {
        // SAFETY: the device is one of this instance's.
        let extensions = unsafe { self.raw.enumerate_device_extension_properties(device) }.unwrap_or_default();
        extensions.iter().any(|extension| extension.extension_name_as_c_str() == Ok(name))
    }

    /// How large a device, which has Vulkan 1.2, allows things to be.
    pub(crate) fn most_bytes(&self, adapter: &Adapter) -> MostBytes {
        let mut allocation = vk::PhysicalDeviceMaintenance3Properties::default();
        let mut buffer = vk::PhysicalDeviceMaintenance4Properties::default();
        let mut both = vk::PhysicalDeviceProperties2::default().push_next(&mut allocation);
        let tells_buffers = adapter.properties.api_version >= vk::API_VERSION_1_3
            || self.has_extension(adapter.raw, khr::maintenance4::NAME);
        if tells_buffers {
            both = both.push_next(&mut buffer);
        }
        // SAFETY: the device is one of this instance's and has what these structures are of: the first is part of
        // Vulkan 1.1, the second was asked for above.
        unsafe { self.raw.get_physical_device_properties2(adapter.raw, &mut both) };
        let allocation = allocation.max_memory_allocation_size;
        MostBytes {
            allocation,
            buffer: if tells_buffers { buffer.max_buffer_size.min(allocation) } else { allocation },
        }
    }

    /// Bytes of a heap that are still free for this process, where its driver tells.
    pub(crate) fn free_bytes(&self, device: vk::PhysicalDevice, heap: usize) -> Option<u64> {
        if !self.has_extension(device, ext::memory_budget::NAME) {
            return None;
        }
        let mut budget = vk::PhysicalDeviceMemoryBudgetPropertiesEXT::default();
        let mut memory = vk::PhysicalDeviceMemoryProperties2::default().push_next(&mut budget);
        // SAFETY: the device is one of this instance's and has the extension of the structure.
        unsafe { self.raw.get_physical_device_memory_properties2(device, &mut memory) };
        Some(budget.heap_budget[heap].saturating_sub(budget.heap_usage[heap]))
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: whatever was made from the instance is gone: who makes something keeps the instance longer.
        unsafe {
            if let Some((listeners, messenger)) = self.messenger.take() {
                listeners.destroy_debug_utils_messenger(messenger, None);
            }
            self.raw.destroy_instance(None);
        }
    }
}

fn create(entry: &Entry, validated: bool) -> Result<ash::Instance, String> {
    // The highest version whose functions are asked for; what a device has is looked at before it is used.
    let application =
        vk::ApplicationInfo::default().application_name(c"belief-propagation-stereo").api_version(vk::API_VERSION_1_3);
    let mut info = vk::InstanceCreateInfo::default().application_info(&application);
    let layers = [validation::LAYER.as_ptr()];
    let extensions = validation::EXTENSIONS.map(CStr::as_ptr);
    let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&validation::EXTRAS);
    if validated {
        info = info.enabled_layer_names(&layers).enabled_extension_names(&extensions).push_next(&mut features);
    }
    // SAFETY: all that the structure points to lives until the end of the function.
    unsafe { entry.create_instance(&info, None) }.map_err(|error| match error {
        vk::Result::ERROR_INCOMPATIBLE_DRIVER => missing::driver(),
        _ => format!("the Vulkan loader makes no instance: {error}"),
    })
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

fn text<E>(text: Result<&CStr, E>) -> String {
    text.map_or_else(|_| String::new(), |text| text.to_string_lossy().into_owned())
}

/// A version as Vulkan packs it.
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
