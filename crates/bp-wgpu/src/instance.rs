//! The adapters there are.

use bp_core::{DeviceInfo, DeviceKind};
use wgpu::{Adapter, Backends, DeviceType, Instance, InstanceDescriptor, InstanceFlags, MemoryBudgetThresholds};

/// What wgpu is asked to reach devices through.
const BACKENDS: Backends = Backends::VULKAN;

/// All adapters, those expected to be fastest first; none where there is no driver.
pub(crate) fn adapters() -> Vec<Adapter> {
    // Without a backend for this system compiled in, wgpu panics.
    if !Instance::enabled_backend_features().intersects(BACKENDS) {
        return Vec::new();
    }
    let instance = Instance::new(InstanceDescriptor {
        backends: BACKENDS,
        // A debug build would otherwise load validation layers.
        flags: InstanceFlags::empty().with_env(),
        // Drivers let more be allocated than there is, and then swap or end the program.
        memory_budget_thresholds: MemoryBudgetThresholds { for_resource_creation: Some(100), for_device_loss: None },
        ..InstanceDescriptor::new_without_display_handle()
    });
    let mut adapters = pollster::block_on(instance.enumerate_adapters(BACKENDS));
    adapters.sort_by_key(kind);
    adapters
}

/// What an adapter is.
pub(crate) fn kind(adapter: &Adapter) -> DeviceKind {
    match adapter.get_info().device_type {
        DeviceType::DiscreteGpu => DeviceKind::DiscreteGpu,
        DeviceType::IntegratedGpu => DeviceKind::IntegratedGpu,
        DeviceType::VirtualGpu => DeviceKind::VirtualGpu,
        DeviceType::Other => DeviceKind::Other,
        DeviceType::Cpu => DeviceKind::SoftwareRasteriser,
    }
}

/// What is known of an adapter. wgpu tells neither its memory nor its identifier.
pub(crate) fn info(adapter: &Adapter) -> DeviceInfo {
    let info = adapter.get_info();
    let driver = [info.driver, info.driver_info].join(" ").trim().to_owned();
    DeviceInfo {
        name: info.name,
        kind: kind(adapter),
        api: Some("Vulkan through wgpu 30".to_owned()),
        driver: Some(driver).filter(|driver| !driver.is_empty()),
        memory_bytes: None,
        uuid: None,
        workers: 1,
    }
}

/// Why there is no device at an index beyond `count` adapters.
pub(crate) fn missing(count: usize) -> String {
    if count > 0 {
        let devices = if count == 1 { "is 1 device" } else { &format!("are {count} devices") };
        return format!("there {devices}, numbered from 0");
    }
    let set = |name: &&str| std::env::var_os(name).map(|value| format!("; {name} is {}", value.display()));
    let variables: String = ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"].iter().filter_map(set).collect();
    format!(
        "no Vulkan loader (libvulkan.so.1) with a working driver was found. Install the GPU vendor's driver, or on Debian \
         `apt-get install libvulkan1 mesa-vulkan-drivers`. In a container, VK_DRIVER_FILES may have to name the driver's \
         ICD file, such as nvidia_icd.json{variables}"
    )
}
