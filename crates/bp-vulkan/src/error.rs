//! What Vulkan answers, as errors that say who can mend it.

use std::time::Duration;

use ash::vk;
use bp_core::Error;

/// How long a device may take for what it was given: a program is cut into pieces that take a fraction of a second.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);

/// The error of a call that was `doing` something on a device.
pub(crate) fn failed(device: &str, doing: &str, result: vk::Result) -> Error {
    let device = device.to_owned();
    match result {
        vk::Result::ERROR_DEVICE_LOST => Error::DeviceLost { device, reason: format!("{doing}: {result}") },
        vk::Result::TIMEOUT => Error::Timeout { device, seconds: PATIENCE.as_secs() },
        _ => Error::Device { device, reason: format!("{doing}: {result}") },
    }
}

/// The error of a call that asked for `bytes` of memory.
pub(crate) fn not_allocated(device: &str, what: &'static str, bytes: u64, result: vk::Result) -> Error {
    match result {
        vk::Result::ERROR_OUT_OF_DEVICE_MEMORY
        | vk::Result::ERROR_OUT_OF_HOST_MEMORY
        | vk::Result::ERROR_TOO_MANY_OBJECTS => Error::OutOfMemory { what, needed: bytes, available: None },
        _ => failed(device, what, result),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_sorted_by_who_can_mend_them() {
        assert!(matches!(failed("d", "x", vk::Result::ERROR_DEVICE_LOST), Error::DeviceLost { .. }));
        assert!(matches!(failed("d", "x", vk::Result::TIMEOUT), Error::Timeout { seconds: 60, .. }));
        let other = failed("d", "making a pipeline", vk::Result::ERROR_OUT_OF_HOST_MEMORY);
        assert_eq!(other.to_string(), "d: making a pipeline: A host memory allocation has failed");
        let full = not_allocated("d", "buffers", 7, vk::Result::ERROR_OUT_OF_DEVICE_MEMORY);
        assert_eq!(full, Error::OutOfMemory { what: "buffers", needed: 7, available: None });
        assert!(matches!(not_allocated("d", "x", 7, vk::Result::ERROR_DEVICE_LOST), Error::DeviceLost { .. }));
    }
}
