//! The list of adapters.

use bp_core::{DeviceInfo, DeviceKind};
use bp_gpu::missing;
use wgpu::{Adapter, Backends, DeviceType, Instance, InstanceDescriptor, InstanceFlags};

use crate::{gpu::caught, vulkan};

/// The APIs through which wgpu may reach devices.
const BACKENDS: Backends = Backends::VULKAN;

/// All adapters, starting with the probably fastest one. Empty without a driver. The error is the reason as text.
pub(crate) fn adapters() -> Result<Vec<Adapter>, String> {
    // wgpu panics if no backend for this system is compiled in.
    if !Instance::enabled_backend_features().intersects(BACKENDS) {
        return Ok(Vec::new());
    }
    let instance = Instance::new(InstanceDescriptor {
        backends: BACKENDS,
        // A debug build would otherwise load validation layers.
        flags: InstanceFlags::empty().with_env(),
        // No memory thresholds. With them, wgpu refuses to upload more than fits into the host's small window to a
        // GPU's memory, although the data can lie outside it. `WgpuDevice` itself checks how much is free.
        ..InstanceDescriptor::new_without_display_handle()
    });
    // wgpu panics if a driver fails to list its extensions.
    let mut adapters = caught(|| pollster::block_on(instance.enumerate_adapters(BACKENDS)))?;
    adapters.sort_by_key(kind);
    Ok(adapters)
}

/// The kind of an adapter.
pub(crate) fn kind(adapter: &Adapter) -> DeviceKind {
    match adapter.get_info().device_type {
        DeviceType::DiscreteGpu => DeviceKind::DiscreteGpu,
        DeviceType::IntegratedGpu => DeviceKind::IntegratedGpu,
        DeviceType::VirtualGpu => DeviceKind::VirtualGpu,
        DeviceType::Other => DeviceKind::Other,
        DeviceType::Cpu => DeviceKind::SoftwareRasteriser,
    }
}

/// The description of an adapter.
pub(crate) fn info(adapter: &Adapter) -> DeviceInfo {
    let info = adapter.get_info();
    let driver = [info.driver, info.driver_info].join(" ").trim().to_owned();
    let kind = kind(adapter);
    DeviceInfo {
        name: info.name,
        kind,
        api: vulkan::api(adapter),
        driver: Some(driver).filter(|driver| !driver.is_empty()),
        // A software rasteriser has no memory of its own.
        memory_bytes: vulkan::memory_bytes(adapter).filter(|_| kind != DeviceKind::SoftwareRasteriser),
        uuid: vulkan::uuid(adapter),
        workers: 1,
    }
}

/// The reason why there is no device at an index beyond `count` adapters.
pub(crate) fn missing(count: usize) -> String {
    match count {
        0 if !vulkan::has_loader() => missing::loader(),
        // wgpu does not say why a driver lists nothing.
        0 => format!("{}; if there is one, memory may be short", missing::driver()),
        _ => missing::device(count),
    }
}
