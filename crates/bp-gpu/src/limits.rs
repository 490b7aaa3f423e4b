//! What a device allows.

use bp_core::DeviceKind;

/// The limits of a device that a [`crate::Program`] is made for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Name of the device, for error messages.
    pub device: String,
    /// Most bytes of a buffer that a kernel can be given.
    pub binding_bytes: u64,
    /// Most bytes of a buffer.
    pub buffer_bytes: u64,
    /// Most storage buffers that a kernel can be given.
    pub bindings: u32,
    /// Most workgroups of a dispatch.
    pub workgroups: u32,
    /// Bytes of memory that buffers may take, where that is known.
    pub memory_bytes: Option<u64>,
    /// Message entries after which a dispatch is split, so that none keeps the device busy for long.
    pub dispatch_entries: u64,
}

impl Limits {
    /// Those of a device that allows nearly anything: to look at programs where there is none.
    #[must_use]
    pub fn roomy() -> Self {
        Self {
            device: "a device".to_owned(),
            binding_bytes: 1 << 32,
            buffer_bytes: 1 << 32,
            bindings: 16,
            workgroups: 65_535,
            memory_bytes: None,
            dispatch_entries: 1 << 30,
        }
    }

    /// How many message entries a device of this kind is sure to compute within 0.2 s: the slowest move some 10 GB/s, and
    /// an entry moves four bytes or less; a software rasteriser takes about a nanosecond an entry on two cores, ten
    /// on a slow one.
    #[must_use]
    pub fn dispatch_entries(kind: DeviceKind) -> u64 {
        match kind {
            DeviceKind::DiscreteGpu => 1 << 28,
            DeviceKind::IntegratedGpu | DeviceKind::VirtualGpu | DeviceKind::Other => 1 << 27,
            DeviceKind::Processor | DeviceKind::SoftwareRasteriser => 1 << 24,
        }
    }
}
