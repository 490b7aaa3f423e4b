//! The Vulkan loader.
#![expect(unsafe_code, reason = "Vulkan is a C interface")]

use std::sync::LazyLock;

use ash::Entry;
use bp_gpu::missing;

/// The loader. It is never unloaded, because drivers may leave behind code that threads run when they exit.
static ENTRY: LazyLock<Result<Entry, String>> = LazyLock::new(|| {
    // SAFETY: a Vulkan loader may be loaded at any time, and nothing else is loaded under its name.
    unsafe { Entry::load() }.map_err(|error| format!("{} ({error})", missing::loader()))
});

/// The loader, or why there is none.
pub(crate) fn entry() -> Result<&'static Entry, String> {
    ENTRY.as_ref().map_err(Clone::clone)
}
