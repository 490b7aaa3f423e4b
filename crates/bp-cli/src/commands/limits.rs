//! Limits of the files that commands read.

use bp_core::DeviceKind;
use bp_io::Limits;
use bp_stereo::Memory;

/// How much a file may hold, and how much memory reading it may take.
pub(super) fn limits(megapixels: u32) -> Limits {
    Limits::megapixels(megapixels).within(Memory::available_to(DeviceKind::Processor))
}
