//! The GPU backend through Vulkan, with raw ash. It allocates, compiles, records and submits the programs of `bp_gpu`.
//!
//! * `loader` finds the Vulkan library, `instance` connects to the drivers, and `adapter` describes their devices.
//! * `gpu` is an open device with its queue, and `device` prepares plans on it. `limits` and `memory` describe it.
//! * A prepared program is a `queue` of work over its `resources`: `buffers`, bind groups and `pipelines`, which naga
//!   translates in `spirv`.
//! * `commands` records, `timeline` submits and waits, and `timer` reads the device's clock.
//! * `statistics` asks a driver's compiler about kernels, without running them.
//! * Every Vulkan handle is an `object` with one owner.
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
mod statistics;
mod timeline;
mod timer;
pub mod validation;

use adapter::Adapter;
use bp_core::{Backend, Device, DeviceInfo, Error};
use bp_gpu::{Limits, missing};
use device::VulkanDevice;
use instance::Instance;

pub use statistics::{Statistics, statistics};

/// The backend.
#[derive(Clone, Copy, Debug, Default)]
pub struct Vulkan;

impl Vulkan {
    /// Opens a device by its index in [`Backend::devices`], with changed limits. Tests lower them, so that small plans are
    /// split like large ones.
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
