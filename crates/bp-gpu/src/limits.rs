//! The limits of a device.

use bp_core::DeviceKind;

use crate::Shape;

/// The limits of the device that a [`crate::Program`] is made for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Name of the device, for error messages.
    pub device: String,
    /// The largest buffer that a kernel can bind, in bytes.
    pub binding_bytes: u64,
    /// The largest buffer, in bytes.
    pub buffer_bytes: u64,
    /// The most storage buffers that a kernel can bind.
    pub bindings: u32,
    /// The most workgroups of a dispatch.
    pub workgroups: u32,
    /// The most invocations of a workgroup.
    pub invocations: u32,
    /// The bytes that all buffers together may take, if known.
    pub memory_bytes: Option<u64>,
    /// The shape of the kernels that suits it.
    pub shape: Shape,
    /// The message entries after which a dispatch is split, so that none keeps the device busy for long.
    pub dispatch_entries: u64,
}

impl Limits {
    /// The limits of an imaginary device that allows nearly everything, to inspect programs without a device.
    #[must_use]
    pub fn roomy() -> Self {
        Self {
            device: "a device".to_owned(),
            binding_bytes: 1 << 32,
            buffer_bytes: 1 << 32,
            bindings: 16,
            workgroups: 65_535,
            invocations: 1024,
            memory_bytes: None,
            shape: Shape::Words,
            dispatch_entries: 1 << 30,
        }
    }

    /// The message entries that even the slowest device of this kind computes within 0.2 s. The slowest GPUs move 10
    /// GB/s, and an entry moves four bytes or less. A software rasteriser takes about 1 ns for an entry on two cores,
    /// and 10 ns on a slow core.
    #[must_use]
    pub fn dispatch_entries(kind: DeviceKind) -> u64 {
        match kind {
            DeviceKind::DiscreteGpu => 1 << 28,
            DeviceKind::IntegratedGpu | DeviceKind::VirtualGpu | DeviceKind::Other => 1 << 27,
            DeviceKind::Processor | DeviceKind::SoftwareRasteriser => 1 << 24,
        }
    }
}
