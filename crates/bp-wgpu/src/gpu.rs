//! An open wgpu device that turns all failures into errors. By default, wgpu panics on errors that nobody handles.

use std::{
    any::Any,
    mem,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{Arc, OnceLock},
};

use bp_core::Error;
use bp_gpu::PATIENCE;
use wgpu::{ErrorFilter, PollError, PollType, SubmissionIndex};

/// An open wgpu device. Everything prepared on it shares it.
pub(crate) struct Gpu {
    /// Its name, for error messages.
    pub(crate) name: String,
    /// The wgpu device, which makes resources.
    pub(crate) device: wgpu::Device,
    /// The wgpu queue, which runs commands.
    pub(crate) queue: wgpu::Queue,
    /// The error that ended it. Nothing works after that.
    end: Arc<OnceLock<Error>>,
}

impl Gpu {
    /// Takes an open device, and registers callbacks for errors that wgpu reports outside of calls.
    pub(crate) fn new(name: String, device: wgpu::Device, queue: wgpu::Queue) -> Self {
        let end = Arc::new(OnceLock::new());
        let (lost, lost_name) = (Arc::clone(&end), name.clone());
        device.set_device_lost_callback(move |_, reason| {
            _ = lost.set(Error::DeviceLost { device: lost_name.clone(), reason });
        });
        let (failed, failed_name) = (Arc::clone(&end), name.clone());
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            _ = failed.set(Error::Device { device: failed_name.clone(), reason: error.to_string() });
        }));
        Self { name, device, queue, end }
    }

    /// Runs `work` and returns its errors. `bytes` is the memory that the work allocates or has allocated before.
    pub(crate) fn guard<T>(&self, bytes: u64, work: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
        self.alive()?;
        let filters = [ErrorFilter::Validation, ErrorFilter::Internal, ErrorFilter::OutOfMemory];
        let scopes = filters.map(|filter| self.device.push_error_scope(filter));
        // wgpu panics if it notices during a wait that the device is lost. Any panic may leave its state inconsistent.
        let result = caught(work).unwrap_or_else(|panic| Err(self.ended(self.lost(panic))));
        // Check for lack of memory first: wgpu reports a buffer that it could not allocate as invalid at every use.
        let errors = scopes.into_iter().rev().map(|scope| pollster::block_on(scope.pop()));
        let error = errors.fold(None, Option::or);
        // wgpu also considers a device lost if it lacks memory.
        if let Some(wgpu::Error::OutOfMemory { .. }) = error {
            return Err(Error::OutOfMemory { what: "buffers on the device", needed: bytes, available: None });
        }
        self.alive()?;
        match error {
            Some(error) => Err(self.failed(error.to_string())),
            None => result,
        }
    }

    /// Waits until a submission is done. Call this under [`Gpu::guard`].
    pub(crate) fn wait(&self, submission: &SubmissionIndex) -> Result<(), Error> {
        self.wait_for(Some(submission.clone()))
    }

    /// As [`Gpu::wait`]; `None` waits for all submissions.
    fn wait_for(&self, submission_index: Option<SubmissionIndex>) -> Result<(), Error> {
        let wait = PollType::Wait { submission_index, timeout: Some(PATIENCE) };
        let end = match self.device.poll(wait) {
            Ok(_) => return Ok(()),
            Err(PollError::Timeout) => Error::Timeout { device: self.name.clone(), seconds: PATIENCE.as_secs() },
            // The index belongs to a submission that a lost device did not accept.
            Err(error) => self.lost(error.to_string()),
        };
        Err(self.ended(end))
    }

    /// Records the error that ended the device, and returns the first such error.
    fn ended(&self, end: Error) -> Error {
        self.end.get_or_init(|| end).clone()
    }

    fn lost(&self, reason: String) -> Error {
        Error::DeviceLost { device: self.name.clone(), reason }
    }

    /// An error of this device.
    pub(crate) fn failed(&self, reason: String) -> Error {
        Error::Device { device: self.name.clone(), reason }
    }

    fn alive(&self) -> Result<(), Error> {
        self.end.get().map_or(Ok(()), |end| Err(end.clone()))
    }
}

impl Drop for Gpu {
    fn drop(&mut self) {
        // Dropping the last handle makes wgpu wait for the device without a time limit. So a device that does not
        // answer stays until the process ends.
        if self.guard(0, || self.wait_for(None)).is_err() {
            mem::forget((self.device.clone(), self.queue.clone()));
        }
    }
}

/// Runs `work`. The error is the message of its panic.
pub(crate) fn caught<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|panic| message(panic.as_ref()))
}

/// The message of a panic.
fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied().or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    text.map_or_else(|| "wgpu panicked".to_owned(), |text| format!("wgpu panicked: {text}"))
}
