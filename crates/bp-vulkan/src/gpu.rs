//! An open device with one compute queue.
#![expect(unsafe_code, reason = "Vulkan is a C interface")]

use std::{
    mem::ManuallyDrop,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
};

use ash::{prelude::VkResult, vk};
use bp_core::Error;

use crate::{
    adapter::{Adapter, MostBytes},
    error::{failed, not_allocated},
    instance::Instance,
};

/// A logical device and its queue.
pub(crate) struct Gpu {
    raw: ash::Device,
    queue: Mutex<vk::Queue>,
    /// The family of the queue.
    pub(crate) family: u32,
    /// The number of valid bits in its timestamps; 0 if it has no clock.
    pub(crate) timestamp_bits: u32,
    /// The adapter that it was opened from.
    pub(crate) adapter: Adapter,
    /// Its types of memory.
    pub(crate) memory: vk::PhysicalDeviceMemoryProperties,
    /// The size limits of an allocation and of a buffer.
    pub(crate) most_bytes: MostBytes,
    /// Destroyed after the device, or never.
    instance: ManuallyDrop<Instance>,
    abandoned: AtomicBool,
}

impl Gpu {
    /// Opens a device. The error is the reason as text.
    pub(crate) fn open(instance: Instance, adapter: Adapter) -> Result<Self, String> {
        Self::open_with(instance, adapter, vk::DeviceCreateInfo::default())
    }

    /// As [`Gpu::open`], with what `info` asks for besides.
    pub(crate) fn open_with(
        instance: Instance,
        adapter: Adapter,
        info: vk::DeviceCreateInfo<'_>,
    ) -> Result<Self, String> {
        if adapter.properties.api_version < vk::API_VERSION_1_2 {
            let (name, api) = (&adapter.info.name, adapter.info.api.as_deref().unwrap_or_default());
            return Err(format!("{name} has {api} where 1.2 is needed; a newer driver may have it"));
        }
        // SAFETY: the device belongs to this instance, here and below.
        let families = unsafe { instance.raw().get_physical_device_queue_family_properties(adapter.raw) };
        let family = best_family(&families).ok_or_else(|| format!("{} does not compute", adapter.info.name))?;
        let raw = make(&instance, &adapter, family, info)?;
        Ok(Self {
            // SAFETY: the device was made with one queue of this family.
            queue: Mutex::new(unsafe { raw.get_device_queue(family, 0) }),
            raw,
            family,
            timestamp_bits: families[family as usize].timestamp_valid_bits,
            // SAFETY: as above.
            memory: unsafe { instance.raw().get_physical_device_memory_properties(adapter.raw) },
            most_bytes: adapter.most_bytes(instance.raw()),
            adapter,
            instance: ManuallyDrop::new(instance),
            abandoned: AtomicBool::new(false),
        })
    }

    /// The functions of the device.
    pub(crate) fn raw(&self) -> &ash::Device {
        &self.raw
    }

    /// The instance that it belongs to.
    pub(crate) fn instance(&self) -> &Instance {
        &self.instance
    }

    /// Its name.
    pub(crate) fn name(&self) -> &str {
        &self.adapter.info.name
    }

    /// Submits work to the queue, which all solvers of the device share.
    pub(crate) fn submit(&self, work: &vk::SubmitInfo<'_>) -> Result<(), Error> {
        let queue = self.queue.lock().unwrap_or_else(PoisonError::into_inner);
        // SAFETY: the lock gives exclusive access to the queue. The caller keeps what the work uses until it is done.
        let submitted = unsafe { self.raw.queue_submit(*queue, std::slice::from_ref(work), vk::Fence::null()) };
        self.checked("submitting work", submitted)
    }

    /// Turns the result of a call into an error, and abandons the device if it was lost.
    pub(crate) fn checked<T>(&self, doing: &'static str, answer: VkResult<T>) -> Result<T, Error> {
        answer.map_err(|result| {
            self.abandon_if_lost(result);
            failed(self.name(), doing, result)
        })
    }

    /// As [`Gpu::checked`], for a call that allocates.
    pub(crate) fn allocated<T>(&self, what: &'static str, bytes: u64, answer: VkResult<T>) -> Result<T, Error> {
        answer.map_err(|result| {
            self.abandon_if_lost(result);
            not_allocated(self.name(), what, bytes, result)
        })
    }

    fn abandon_if_lost(&self, result: vk::Result) {
        if result == vk::Result::ERROR_DEVICE_LOST {
            self.abandon();
        }
    }

    /// Abandons the device: from now on none of its objects are destroyed.
    pub(crate) fn abandon(&self) {
        self.abandoned.store(true, Ordering::Release);
    }

    /// Whether the device was lost or did not answer in time.
    pub(crate) fn is_abandoned(&self) -> bool {
        self.abandoned.load(Ordering::Acquire)
    }

    /// Fails if the device was abandoned.
    pub(crate) fn check(&self) -> Result<(), Error> {
        if self.is_abandoned() {
            let reason = "it failed earlier; open it anew".to_owned();
            return Err(Error::DeviceLost { device: self.name().to_owned(), reason });
        }
        Ok(())
    }
}

impl Drop for Gpu {
    fn drop(&mut self) {
        // An abandoned device may still be working, and destroying it would wait for that. So the device and its
        // instance stay until the process ends.
        if self.is_abandoned() {
            return;
        }
        // SAFETY: every object of the device kept it open, so all of them are gone. No work is under way, because
        // whoever submits work waits for it. The instance is dropped once, after its only device.
        unsafe {
            self.raw.destroy_device(None);
            ManuallyDrop::drop(&mut self.instance);
        }
    }
}

/// Makes a logical device with one queue of this family. The device must support Vulkan 1.2 and what `info` asks for.
fn make(
    instance: &Instance,
    adapter: &Adapter,
    family: u32,
    info: vk::DeviceCreateInfo<'_>,
) -> Result<ash::Device, String> {
    let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(family).queue_priorities(&[1.0])];
    let mut features = vk::PhysicalDeviceVulkan12Features::default().timeline_semaphore(true);
    let info = info.queue_create_infos(&queues).push_next(&mut features);
    // SAFETY: the device belongs to this instance and has the family. Timeline semaphores are part of Vulkan 1.2.
    let raw = unsafe { instance.raw().create_device(adapter.raw, &info, None) };
    raw.map_err(|error| format!("{} cannot be opened: {error}", adapter.info.name))
}

/// The queue family to compute on: preferably one with a clock and, among those, one without graphics. Work on a queue
/// without graphics does not block the desktop, and drivers allow it more time before they report a hang.
fn best_family(families: &[vk::QueueFamilyProperties]) -> Option<u32> {
    let computes = |family: &vk::QueueFamilyProperties| family.queue_flags.contains(vk::QueueFlags::COMPUTE);
    let draws = |family: &vk::QueueFamilyProperties| family.queue_flags.contains(vk::QueueFlags::GRAPHICS);
    let able = families.iter().enumerate().filter(|(_, family)| computes(family));
    let best = able.min_by_key(|(_, family)| (family.timestamp_valid_bits == 0, draws(family)));
    best.map(|(index, _)| index as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn family(flags: vk::QueueFlags, timestamp_valid_bits: u32) -> vk::QueueFamilyProperties {
        vk::QueueFamilyProperties { queue_flags: flags, queue_count: 1, timestamp_valid_bits, ..Default::default() }
    }

    #[test]
    fn the_best_queue_family_keeps_time_and_draws_nothing() {
        let all = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
        let copies = family(vk::QueueFlags::TRANSFER, 64);
        assert_eq!(best_family(&[copies]), None);
        assert_eq!(best_family(&[copies, family(all, 64)]), Some(1));
        assert_eq!(best_family(&[family(all, 64), copies, family(vk::QueueFlags::COMPUTE, 36)]), Some(2));
        assert_eq!(best_family(&[family(vk::QueueFlags::COMPUTE, 0), family(all, 36)]), Some(1));
    }
}
