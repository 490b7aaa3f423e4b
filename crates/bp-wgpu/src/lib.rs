//! The GPU backend through wgpu. Its labels and messages are bit-identical to those of the scalar backend.
//!
//! It allocates, compiles, encodes and submits the programs of `bp_gpu`, and turns all failures into errors. Its devices are
//! those with a Vulkan driver.
//!
//! * `instance` lists adapters, and `device` opens them. `vulkan` queries properties that wgpu does not report.
//! * `gpu` is an open device. It keeps wgpu from ending the program.
//! * `buffers` and `pipelines` make the resources of a program. `recording` encodes its commands, `queue` runs them, and
//!   `clock` measures their times.
#![deny(clippy::undocumented_unsafe_blocks)]

mod buffers;
mod clock;
mod device;
mod gpu;
mod instance;
mod pipelines;
mod queue;
mod recording;
mod vulkan;

use bp_core::{Backend, Device, DeviceInfo, Error};
use bp_gpu::Limits;

/// The backend.
#[derive(Clone, Copy, Debug, Default)]
pub struct Wgpu;

impl Wgpu {
    /// Opens a device by its index in [`Backend::devices`], with changed limits. Tests lower them, so that small plans are
    /// split like large ones.
    ///
    /// # Errors
    /// [`Error::Unavailable`] with the reason.
    pub fn open_with(&self, device: usize, change: impl FnOnce(&mut Limits)) -> Result<Box<dyn Device>, Error> {
        let open = || {
            let adapters = instance::adapters()?;
            let adapter = adapters.get(device).ok_or_else(|| instance::missing(adapters.len()))?;
            let opened = device::WgpuDevice::open(adapter, change)?;
            bp_gpu::check(&opened)?;
            Ok(Box::new(opened) as Box<dyn Device>)
        };
        open().map_err(|reason| Error::Unavailable { backend: self.name(), device, reason })
    }
}

impl Backend for Wgpu {
    fn name(&self) -> &'static str {
        "wgpu"
    }

    fn devices(&self) -> Vec<DeviceInfo> {
        instance::adapters().unwrap_or_default().iter().map(instance::info).collect()
    }

    fn open(&self, device: usize) -> Result<Box<dyn Device>, Error> {
        self.open_with(device, |_| ())
    }
}
