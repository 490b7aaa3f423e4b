//! The connection to the drivers.
#![expect(unsafe_code, reason = "Vulkan is a C interface")]

use std::ffi::CStr;

use ash::{Entry, ext, vk};
use bp_gpu::missing;

use crate::{adapter::Adapter, loader::entry, validation};

/// A connection to the drivers.
pub(crate) struct Instance {
    raw: ash::Instance,
    /// Receives the messages of the validation layer.
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
}

impl Instance {
    /// Connects to the drivers. The error is the reason as text.
    pub(crate) fn new() -> Result<Self, String> {
        let entry = entry()?;
        // SAFETY: the loader allows the call at any time.
        let version = unsafe { entry.try_enumerate_instance_version() }.ok().flatten();
        if version.is_none_or(|version| version < vk::API_VERSION_1_2) {
            return Err("the Vulkan loader, libvulkan.so.1, is older than Vulkan 1.2".to_owned());
        }
        let validated = validation::is_on(entry);
        let mut instance = Self { raw: create(entry, validated)?, messenger: None };
        if validated {
            let listeners = ext::debug_utils::Instance::new(entry, &instance.raw);
            // SAFETY: the instance was made with the extension.
            let messenger = unsafe { listeners.create_debug_utils_messenger(&validation::listener(), None) };
            instance.messenger = messenger.ok().map(|messenger| (listeners, messenger));
        }
        Ok(instance)
    }

    /// The functions of the instance.
    pub(crate) fn raw(&self) -> &ash::Instance {
        &self.raw
    }

    /// Lists the devices, starting with the probably fastest kind. Devices of a kind are in the order of their drivers.
    pub(crate) fn adapters(&self) -> Result<Vec<Adapter>, String> {
        // SAFETY: the instance is alive.
        let devices = unsafe { self.raw.enumerate_physical_devices() };
        let devices = devices.map_err(|error| {
            format!(
                "the Vulkan drivers list no devices: {error}; memory may be short, or a driver without its hardware"
            )
        })?;
        let mut adapters: Vec<_> = devices.into_iter().map(|device| Adapter::of(&self.raw, device)).collect();
        adapters.sort_by_key(|adapter| adapter.info.kind);
        if adapters.is_empty() { Err(missing::driver()) } else { Ok(adapters) }
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: everything made from the instance is gone, because its owners keep the instance longer.
        unsafe {
            if let Some((listeners, messenger)) = self.messenger.take() {
                listeners.destroy_debug_utils_messenger(messenger, None);
            }
            self.raw.destroy_instance(None);
        }
    }
}

fn create(entry: &Entry, validated: bool) -> Result<ash::Instance, String> {
    // The highest version whose functions are used. Before each use, the code checks what the device supports.
    let application =
        vk::ApplicationInfo::default().application_name(c"belief-propagation-stereo").api_version(vk::API_VERSION_1_3);
    let mut info = vk::InstanceCreateInfo::default().application_info(&application);
    let layers = [validation::LAYER.as_ptr()];
    let extensions = validation::EXTENSIONS.map(CStr::as_ptr);
    let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&validation::EXTRAS);
    if validated {
        info = info.enabled_layer_names(&layers).enabled_extension_names(&extensions).push_next(&mut features);
    }
    // SAFETY: everything that the structure points to lives until the end of the function.
    unsafe { entry.create_instance(&info, None) }.map_err(|error| match error {
        vk::Result::ERROR_INCOMPATIBLE_DRIVER => missing::driver(),
        _ => format!("the Vulkan loader makes no instance: {error}"),
    })
}
