//! GPU backend through Vulkan, by raw ash: allocates, compiles, records and submits what `bp_gpu` asks for.
//!
//! `instance` lists devices and `device` opens them. A prepared program is a `queue` of work over its `resources`:
//! `buffers`, bind groups and `pipelines`, which naga translates in `spirv`. `commands` records, `timeline` submits
//! and waits, `timer` reads the device's clock. Everything that Vulkan makes is an `object` with one owner.
#![deny(clippy::undocumented_unsafe_blocks)]

mod adapter;
mod buffers;
mod commands;
mod device;
mod error;
mod gpu;
mod instance;
mod limits;
mod loader;
mod memory;
mod object;
mod pipelines;
mod queue;
mod resources;
mod spirv;
mod timeline;
mod timer;
pub mod validation;

use adapter::Adapter;
use bp_core::{Backend, Device, DeviceInfo, Error};
use bp_gpu::{Limits, missing};
use device::VulkanDevice;
use instance::Instance;

/// The backend.
#[derive(Clone, Copy, Debug, Default)]
pub struct Vulkan;

impl Vulkan {
    /// Opens a device by its index in [`Backend::devices`], with changed limits: a test may lower them, so that small
    /// plans are cut up like large ones.
    ///
    /// # Errors
    /// [`Error::Unavailable`] with the reason.
    pub fn open_with(&self, device: usize, change: impl FnOnce(&mut Limits)) -> Result<Box<dyn Device>, Error> {
        let open = || {
            let instance = Instance::new()?;
            let adapter = pick(instance.adapters()?, device)?;
            let opened = VulkanDevice::open(instance, adapter, change)?;
            bp_gpu::check(&opened)?;
            Ok(Box::new(opened) as Box<dyn Device>)
        };
        open().map_err(|reason| Error::Unavailable { backend: self.name(), device, reason })
    }
}

impl Backend for Vulkan {
    fn name(&self) -> &'static str {
        "vulkan"
    }

    fn devices(&self) -> Vec<DeviceInfo> {
        let adapters = Instance::new().and_then(|instance| instance.adapters());
        adapters.unwrap_or_default().into_iter().map(|adapter| adapter.info).collect()
    }

    fn open(&self, device: usize) -> Result<Box<dyn Device>, Error> {
        self.open_with(device, |_| ())
    }
}

fn pick(mut adapters: Vec<Adapter>, device: usize) -> Result<Adapter, String> {
    let count = adapters.len();
    if device < count {
        return Ok(adapters.swap_remove(device));
    }
    Err(missing::device(count))
}
