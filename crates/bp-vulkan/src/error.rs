//! Turns the results of Vulkan calls into errors, sorted by who can fix them.

use ash::vk;
use bp_core::Error;
use bp_gpu::PATIENCE;

/// The error of a call that was `doing` something on a device.
pub(crate) fn failed(device: &str, doing: &'static str, result: vk::Result) -> Error {
    let device = device.to_owned();
    match result {
        result if is_out_of_memory(result) => Error::OutOfMemory { what: doing, needed: 0, available: None },
        vk::Result::ERROR_DEVICE_LOST => Error::DeviceLost { device, reason: format!("{doing}: {result}") },
        vk::Result::TIMEOUT => Error::Timeout { device, seconds: PATIENCE.as_secs() },
        _ => Error::Device { device, reason: format!("{doing}: {result}") },
    }
}

/// The error of a call that asked for `bytes` of memory.
pub(crate) fn not_allocated(device: &str, what: &'static str, bytes: u64, result: vk::Result) -> Error {
    if is_out_of_memory(result) {
        return Error::OutOfMemory { what, needed: bytes, available: None };
    }
    failed(device, what, result)
}

/// Whether a resource is exhausted: memory, addresses to map it to, or allocations. A smaller plan may run.
fn is_out_of_memory(result: vk::Result) -> bool {
    [
        vk::Result::ERROR_OUT_OF_DEVICE_MEMORY,
        vk::Result::ERROR_OUT_OF_HOST_MEMORY,
        vk::Result::ERROR_MEMORY_MAP_FAILED,
        vk::Result::ERROR_TOO_MANY_OBJECTS,
    ]
    .contains(&result)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_sorted_by_who_can_mend_them() {
        assert!(matches!(failed("d", "x", vk::Result::ERROR_DEVICE_LOST), Error::DeviceLost { .. }));
        assert!(matches!(failed("d", "x", vk::Result::TIMEOUT), Error::Timeout { seconds: 60, .. }));
        let other = failed("d", "making a pipeline", vk::Result::ERROR_UNKNOWN).to_string();
        assert!(other.starts_with("d: making a pipeline: "), "{other}");
        let host = failed("d", "a pipeline", vk::Result::ERROR_OUT_OF_HOST_MEMORY);
        assert!(matches!(host, Error::OutOfMemory { what: "a pipeline", .. }));
        assert_eq!(host.to_string(), "out of memory: more needed for a pipeline");
        let full = not_allocated("d", "buffers", 7, vk::Result::ERROR_OUT_OF_DEVICE_MEMORY);
        assert_eq!(full, Error::OutOfMemory { what: "buffers", needed: 7, available: None });
        assert!(matches!(not_allocated("d", "x", 7, vk::Result::ERROR_DEVICE_LOST), Error::DeviceLost { .. }));
    }
}
