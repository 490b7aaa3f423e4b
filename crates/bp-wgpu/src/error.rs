//! Whatever goes wrong in wgpu, as an error. By itself wgpu panics where nobody asks for its errors.

use std::{
    any::Any,
    mem,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{Arc, OnceLock},
    time::Duration,
};

use bp_core::Error;
use wgpu::{ErrorFilter, PollError, PollType, SubmissionIndex};

/// How long a device is given to finish what was submitted.
const PATIENCE: Duration = Duration::from_secs(60);

/// An open device of wgpu's, shared by all that is prepared on it.
pub(crate) struct Gpu {
    /// Its name, for error messages.
    pub(crate) name: String,
    /// Makes things.
    pub(crate) device: wgpu::Device,
    /// Runs things.
    pub(crate) queue: wgpu::Queue,
    /// What ended it: nothing works after that.
    end: Arc<OnceLock<Error>>,
}

impl Gpu {
    /// Listens for what wgpu reports outside of calls.
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

    /// Does `work` and tells what went wrong in it; `bytes` is what the work allocates, or has allocated before.
    pub(crate) fn guard<T>(&self, bytes: u64, work: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
        self.alive()?;
        let filters = [ErrorFilter::Validation, ErrorFilter::Internal, ErrorFilter::OutOfMemory];
        let scopes = filters.map(|filter| self.device.push_error_scope(filter));
        // wgpu panics where it notices during a wait that the device is lost.
        let result = catch_unwind(AssertUnwindSafe(work));
        // Lack of memory is asked for first: what could not be allocated is reported as invalid wherever it is used.
        let errors = scopes.into_iter().rev().map(|scope| pollster::block_on(scope.pop()));
        let error = errors.fold(None, Option::or);
        self.alive()?;
        match (error, result) {
            (Some(wgpu::Error::OutOfMemory { .. }), _) => {
                Err(Error::OutOfMemory { what: "buffers on the device", needed: bytes, available: None })
            }
            (Some(error), _) => Err(self.failed(error.to_string())),
            (None, Err(panic)) => Err(self.failed(message(panic.as_ref()))),
            (None, Ok(result)) => result,
        }
    }

    /// Waits until a submission is done. To be called under [`Gpu::guard`].
    pub(crate) fn wait(&self, submission: &SubmissionIndex) -> Result<(), Error> {
        let wait = PollType::Wait { submission_index: Some(submission.clone()), timeout: Some(PATIENCE) };
        let end = match self.device.poll(wait) {
            Ok(_) => return Ok(()),
            Err(PollError::Timeout) => {
                // Dropping the last handle would wait again, without end.
                mem::forget((self.device.clone(), self.queue.clone()));
                Error::Timeout { device: self.name.clone(), seconds: PATIENCE.as_secs() }
            }
            // The index of a submission that a lost device did not take.
            Err(error) => Error::DeviceLost { device: self.name.clone(), reason: error.to_string() },
        };
        Err(self.end.get_or_init(|| end).clone())
    }

    /// An error of this device.
    pub(crate) fn failed(&self, reason: String) -> Error {
        Error::Device { device: self.name.clone(), reason }
    }

    fn alive(&self) -> Result<(), Error> {
        self.end.get().map_or(Ok(()), |end| Err(end.clone()))
    }
}

/// What a panic said.
fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied().or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    text.unwrap_or("wgpu panicked").to_owned()
}
