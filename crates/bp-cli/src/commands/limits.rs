//! Limits of the files that commands read.

use bp_core::DeviceKind;
use bp_io::Limits;
use bp_stereo::Memory;

/// The limits for a file: its size in megapixels, and the free memory for reading it.
pub(super) fn limits(megapixels: u32) -> Limits {
    Limits::megapixels(megapixels).within(Memory::available_to(DeviceKind::Processor))
}
