//! The Khronos validation layer, for tests. It checks that every call and every access follows the rules of Vulkan.
//!
//! `BP_VULKAN_VALIDATION=1` in the environment, or [`turn_on`], loads it for all devices opened from then on. Its messages
//! are counted. After a message, the next call that waits for the device fails.
#![expect(unsafe_code, reason = "the layer calls back through a C interface")]

use std::{
    ffi::{CStr, c_void},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
};

use ash::{Entry, ext, vk};

/// The name of the layer. The Debian package is vulkan-validationlayers.
pub(crate) const LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// The extensions of the layer: the first delivers its messages, the second configures its checks.
pub(crate) const EXTENSIONS: [&CStr; 2] = [ext::debug_utils::NAME, ext::validation_features::NAME];

/// Checks in addition to the default ones.
pub(crate) const EXTRAS: [vk::ValidationFeatureEnableEXT; 1] =
    [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];

static WANTED: AtomicBool = AtomicBool::new(false);

static MESSAGES: Mutex<Messages> = Mutex::new(Messages { count: 0, first: None });

/// The messages of the layer in this process.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Messages {
    /// The number of warnings and errors.
    pub count: usize,
    /// The first message.
    pub first: Option<String>,
}

/// Turns validation on for all devices opened from now on, if the layer is installed.
pub fn turn_on() {
    WANTED.store(true, Ordering::Relaxed);
}

/// Whether the layer is installed.
#[must_use]
pub fn is_installed() -> bool {
    crate::loader::entry().is_ok_and(has_layer)
}

/// The messages of the layer so far.
#[must_use]
pub fn messages() -> Messages {
    MESSAGES.lock().unwrap_or_else(PoisonError::into_inner).clone()
}

/// Whether a new instance loads the layer.
pub(crate) fn is_on(entry: &Entry) -> bool {
    let wanted = WANTED.load(Ordering::Relaxed) || std::env::var_os("BP_VULKAN_VALIDATION").is_some_and(|on| on == "1");
    wanted && has_layer(entry)
}

fn has_layer(entry: &Entry) -> bool {
    // SAFETY: the loader allows the call at any time.
    let layers = unsafe { entry.enumerate_instance_layer_properties() }.unwrap_or_default();
    layers.iter().any(|layer| layer.layer_name_as_c_str() == Ok(LAYER))
}

/// Describes the callback that receives the layer's messages.
pub(crate) fn listener() -> vk::DebugUtilsMessengerCreateInfoEXT<'static> {
    vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(vk::DebugUtilsMessageSeverityFlagsEXT::WARNING | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR)
        .message_type(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION)
        .pfn_user_callback(Some(keep))
}

/// Records a message.
unsafe extern "system" fn keep(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    _user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the layer passes a valid structure, whose message is null or ends in a zero byte.
    let message = unsafe { data.as_ref().and_then(|data| data.message_as_c_str()) };
    let mut messages = MESSAGES.lock().unwrap_or_else(PoisonError::into_inner);
    messages.count += 1;
    messages.first.get_or_insert_with(|| message.unwrap_or_default().to_string_lossy().into_owned());
    vk::FALSE
}
