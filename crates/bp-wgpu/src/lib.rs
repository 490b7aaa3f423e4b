//! GPU backend through wgpu. Its labels and messages are the scalar backend's to the bit.
//!
//! `bp-gpu` says what runs: this crate allocates, compiles, encodes and submits what a program says, and turns
//! all that can go wrong there into errors. Its devices are those that have a Vulkan driver.
//!
//! `instance` lists adapters, `device` opens one, `buffers` and `pipelines` make what a program names, `recording` encodes
//! its commands, `queue` runs them, `clock` times them, `gpu` keeps wgpu from ending the program, and
//! `vulkan` asks for what wgpu does not tell.
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
    /// Opens a device as [`Backend::open`] does, but lets `change` lower what it is said to allow: how a small image
    /// tests what else takes a large one.
    ///
    /// # Errors
    /// [`Error::Unavailable`] with the reason.
    pub fn open_with(&self, device: usize, change: impl FnOnce(&mut Limits)) -> Result<Box<dyn Device>, Error> {
        let open = || {
            let adapters = instance::adapters();
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
        instance::adapters().iter().map(instance::info).collect()
    }

    fn open(&self, device: usize) -> Result<Box<dyn Device>, Error> {
        self.open_with(device, |_| ())
    }
}
