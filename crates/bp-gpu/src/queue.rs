//! What an API to devices must offer, so that [`crate::GpuSolver`] can run a program on it.

use std::time::Duration;

use bp_core::Error;

/// How long a device is given to finish what was submitted. A submission takes a fraction of a second, see
/// [`crate::Limits::dispatch_entries`].
pub const PATIENCE: Duration = Duration::from_secs(60);

/// A program made ready on a device: buffers allocated and cleared, kernels compiled, segments recorded.
///
/// Segments run in the order in which they are appended. No method but [`Queue::read`] allocates device memory or
/// compiles.
pub trait Queue: Send {
    /// Begins anew: waits for work under way, drops what was appended and not submitted, forgets all marks, and lets
    /// `fill` write the program's upload buffer.
    ///
    /// # Errors
    /// Those of the device.
    fn begin(&mut self, fill: &mut dyn FnMut(&mut [u8])) -> Result<(), Error>;

    /// Appends a segment of the program, by its index in [`crate::Program::segments`].
    ///
    /// # Errors
    /// Those of the device.
    fn append(&mut self, segment: usize) -> Result<(), Error>;

    /// Appends a mark: the device notes the time when all before it is done. At most [`crate::Program::marks`] are kept,
    /// further ones are dropped.
    ///
    /// # Errors
    /// Those of the device.
    fn mark(&mut self) -> Result<(), Error>;

    /// Hands what was appended to the device, then waits until the submission before this one is done, so that the
    /// device never runs out of work and the caller never runs far ahead of it.
    ///
    /// # Errors
    /// Those of the device.
    fn submit(&mut self) -> Result<(), Error>;

    /// Submits what is left, waits for everything, and shows `read` the program's download buffer.
    ///
    /// # Errors
    /// Those of the device.
    fn finish(&mut self, read: &mut dyn FnMut(&[u8])) -> Result<(), Error>;

    /// The times between marks, as many as were made less one, once [`Queue::finish`] has returned; fewer, or none,
    /// where the device keeps no time.
    fn times(&mut self) -> &[Duration];

    /// Copies a whole buffer out, by its index in [`crate::Program::buffers`]; for comparing backends, not for speed.
    ///
    /// # Errors
    /// Those of the device.
    fn read(&mut self, buffer: usize) -> Result<Vec<u8>, Error>;

    /// Time that compiling took.
    fn compile_time(&self) -> Duration;

    /// Bytes allocated for the program, counted.
    fn allocated_bytes(&self) -> u64;
}
