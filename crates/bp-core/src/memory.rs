//! Allocation that fails with an error instead of ending the program.

use crate::Error;

/// A vector of `len` copies of `value`, its memory written, so that no page is first touched while a solve is timed.
///
/// # Errors
/// [`Error::OutOfMemory`] where the allocator refuses; `what` names the buffer there.
pub fn filled<T: Clone>(what: &'static str, len: usize, value: T) -> Result<Vec<T>, Error> {
    let mut values = Vec::new();
    let needed = (len as u64).saturating_mul(size_of::<T>() as u64);
    values.try_reserve_exact(len).map_err(|_| Error::OutOfMemory { what, needed, available: None })?;
    values.resize(len, value);
    Ok(values)
}

/// Bytes that a vector holds.
#[must_use]
pub fn bytes<T>(values: &Vec<T>) -> u64 {
    (values.capacity() * size_of::<T>()) as u64
}
