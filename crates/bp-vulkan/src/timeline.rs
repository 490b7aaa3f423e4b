//! Submits work and waits for it.
#![expect(unsafe_code, reason = "Vulkan is a C interface")]

use std::sync::Arc;

use ash::vk;
use bp_core::Error;

use bp_gpu::PATIENCE;

use crate::{gpu::Gpu, object::Owned, validation};

/// Counts the submitted and the finished pieces of work.
pub(crate) struct Timeline {
    semaphore: Owned<vk::Semaphore>,
    gpu: Arc<Gpu>,
    submitted: u64,
}

impl Timeline {
    /// Starts without submitted work.
    pub(crate) fn new(gpu: &Arc<Gpu>) -> Result<Self, Error> {
        let mut kind = vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
        let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
        // SAFETY: the device was opened with timeline semaphores.
        let semaphore = gpu.checked("making a semaphore", unsafe { gpu.raw().create_semaphore(&info, None) })?;
        Ok(Self { semaphore: Owned::new(gpu, semaphore), gpu: Arc::clone(gpu), submitted: 0 })
    }

    /// The number of pieces submitted so far.
    pub(crate) fn submitted(&self) -> u64 {
        self.submitted
    }

    /// Submits a piece of work: command buffers that run in this order.
    pub(crate) fn submit(&mut self, commands: &[vk::CommandBuffer]) -> Result<(), Error> {
        let value = [self.submitted + 1];
        let mut values = vk::TimelineSemaphoreSubmitInfo::default().signal_semaphore_values(&value);
        let work = vk::SubmitInfo::default()
            .command_buffers(commands)
            .signal_semaphores(std::slice::from_ref(&self.semaphore.raw))
            .push_next(&mut values);
        self.gpu.submit(&work)?;
        self.submitted += 1;
        Ok(())
    }

    /// Waits until this many pieces are done. Fails if the device was abandoned.
    pub(crate) fn wait(&self, done: u64) -> Result<(), Error> {
        self.gpu.check()?;
        let info = vk::SemaphoreWaitInfo::default();
        let (semaphores, values) = ([self.semaphore.raw], [done]);
        let info = info.semaphores(&semaphores).values(&values);
        // SAFETY: the semaphore belongs to the device and is alive.
        let waited = unsafe { self.gpu.raw().wait_semaphores(&info, PATIENCE.as_nanos() as u64) };
        if waited.is_err() {
            // For whatever reason it failed, the work may still be under way.
            self.gpu.abandon();
        }
        self.gpu.checked("waiting for its work", waited)?;
        match validation::messages().first {
            Some(reason) => Err(Error::Device { device: self.gpu.name().to_owned(), reason }),
            None => Ok(()),
        }
    }

    /// Waits until all work is done.
    pub(crate) fn wait_for_all(&self) -> Result<(), Error> {
        self.wait(self.submitted)
    }
}

impl Drop for Timeline {
    fn drop(&mut self) {
        // The resources that the work uses are destroyed next. If waiting fails, it abandons the device, so nothing is
        // destroyed.
        _ = self.wait_for_all();
    }
}
