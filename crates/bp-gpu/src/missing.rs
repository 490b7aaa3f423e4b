//! Messages for machines that lack something Vulkan needs.

use std::env;

/// The loader is missing.
#[must_use]
pub fn loader() -> String {
    "there is no Vulkan loader, the library libvulkan.so.1: install libvulkan1 (Debian, Ubuntu), vulkan-loader (Fedora) or \
     vulkan-icd-loader (Arch)"
        .to_owned()
}

/// The loader finds no driver.
#[must_use]
pub fn driver() -> String {
    let name = |name| Some((name, env::var_os(name).filter(|files| !files.is_empty())?));
    let Some((name, files)) = name("VK_DRIVER_FILES").or_else(|| name("VK_ICD_FILENAMES")) else {
        return "the Vulkan loader finds no driver: install the GPU vendor's, or mesa-vulkan-drivers (Debian, Ubuntu); in a \
                container, VK_DRIVER_FILES can name the driver's .json file that is missing in /usr/share/vulkan/icd.d"
            .to_owned();
    };
    format!("the Vulkan loader finds no driver: {name} lets it look for \"{}\" only", files.display())
}

/// A device index is not among the `count` devices.
#[must_use]
pub fn device(count: usize) -> String {
    let are = if count == 1 { "is 1 device" } else { &format!("are {count} devices") };
    format!("there {are}, numbered from 0")
}
