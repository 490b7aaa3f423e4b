//! Allocation that returns an error instead of ending the program, and a measurement of the rate of memory copies.

use std::{hint::black_box, time::Instant};

use crate::Error;

/// Allocates a vector of `len` copies of `value`. Writes its memory now, so that no page is first touched while a solve
/// is timed.
///
/// # Errors
/// [`Error::OutOfMemory`] if the allocator refuses; `what` names the buffer in the error.
pub fn filled<T: Clone>(what: &'static str, len: usize, value: T) -> Result<Vec<T>, Error> {
    let mut values = Vec::new();
    let needed = (len as u64).saturating_mul(size_of::<T>() as u64);
    values.try_reserve_exact(len).map_err(|_| Error::OutOfMemory { what, needed, available: None })?;
    values.resize(len, value);
    Ok(values)
}

/// Lengthens a vector to `len` elements, if it has fewer. It keeps what it allocates.
///
/// # Errors
/// As [`filled`].
pub fn grow<T: Clone>(what: &'static str, values: &mut Vec<T>, len: usize, value: T) -> Result<(), Error> {
    let needed = (len as u64).saturating_mul(size_of::<T>() as u64);
    let more = len.saturating_sub(values.len());
    values.try_reserve_exact(more).map_err(|_| Error::OutOfMemory { what, needed, available: None })?;
    values.resize(len.max(values.len()), value);
    Ok(())
}

/// The bytes that a vector holds.
#[must_use]
pub fn bytes<T>(values: &Vec<T>) -> u64 {
    (values.capacity() * size_of::<T>()) as u64
}

/// The bytes of a copy: more than the caches of most CPUs hold.
const COPIED: usize = 256 << 20;

/// The number of timed copies after one warm-up copy. The median counts.
const COPIES: usize = 9;

/// Measures the total bytes per second that `copy` reads and writes when it copies a buffer in main memory. This is
/// [`crate::Device::copy_rate`] for a CPU.
///
/// # Errors
/// [`Error::OutOfMemory`].
pub fn copy_rate(copy: impl Fn(&[u8], &mut [u8])) -> Result<f64, Error> {
    let from = filled("a buffer to copy", COPIED, 1)?;
    let mut to = filled("its copy", COPIED, 0)?;
    let mut time = || {
        let start = Instant::now();
        copy(black_box(&from), black_box(&mut to));
        start.elapsed()
    };
    time();
    let mut times = [(); COPIES].map(|()| time());
    times.sort_unstable();
    Ok(2.0 * COPIED as f64 / times[COPIES / 2].as_secs_f64().max(f64::MIN_POSITIVE))
}
