//! The queue: everything that [`crate::GpuSolver`] needs from a GPU API.

use std::time::Duration;

use bp_core::Error;

/// The time limit for submitted work. A submission takes a fraction of a second; see [`crate::Limits::dispatch_entries`].
pub const PATIENCE: Duration = Duration::from_secs(60);

/// A program prepared on a device: its buffers are allocated and cleared, kernels compiled, and segments recorded.
///
/// Segments run in the order in which they are appended. No method but [`Queue::read`] allocates device memory or
/// compiles.
pub trait Queue: Send {
    /// Starts a solve: waits for submitted work, drops segments that were not submitted, discards all marks, and lets
    /// `fill` write the upload buffer.
    ///
    /// # Errors
    /// Errors of the device.
    fn begin(&mut self, fill: &mut dyn FnMut(&mut [u8])) -> Result<(), Error>;

    /// Appends a segment of the program, by its index in [`crate::Program::segments`].
    ///
    /// # Errors
    /// Errors of the device.
    fn append(&mut self, segment: usize) -> Result<(), Error>;

    /// Appends a mark: the device records the time when everything before it is done. Marks beyond
    /// [`crate::Program::marks`] are dropped.
    ///
    /// # Errors
    /// Errors of the device.
    fn mark(&mut self) -> Result<(), Error>;

    /// Submits the appended segments, then waits for the previous submission. So the device never runs out of work, and
    /// the caller never runs far ahead.
    ///
    /// # Errors
    /// Errors of the device.
    fn submit(&mut self) -> Result<(), Error>;

    /// Submits the rest, waits for all work, and passes the download buffer to `read`.
    ///
    /// # Errors
    /// Errors of the device.
    fn finish(&mut self, read: &mut dyn FnMut(&[u8])) -> Result<(), Error>;

    /// The times between consecutive marks, after [`Queue::finish`]. There may be fewer, or none without a clock.
    fn times(&mut self) -> &[Duration];

    /// Reads a whole buffer, by its index in [`crate::Program::buffers`]. This is for comparing backends and is slow.
    ///
    /// # Errors
    /// Errors of the device.
    fn read(&mut self, buffer: usize) -> Result<Vec<u8>, Error>;

    /// The time spent on compiling.
    fn compile_time(&self) -> Duration;

    /// The bytes actually allocated for the program.
    fn allocated_bytes(&self) -> u64;
}
