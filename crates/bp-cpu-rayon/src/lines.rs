//! Buffers that start with a line of the cache.

use std::ops::{Deref, DerefMut};

use bp_core::{Error, memory};

/// Bytes of a line.
const LINE: usize = 64;

/// Values of which the first starts a line. A kernel that walks over the labels touches a block of every label. A block that lies
/// across lines touches two of them, and then the labels of a few blocks no longer fit the first-level cache.
pub(crate) struct Lines<T> {
    values: Vec<T>,
    first: usize,
    len: usize,
}

/// The bytes that `len` values of `size` bytes need.
pub(crate) fn bytes(len: usize, size: usize) -> u64 {
    (len as u64).saturating_mul(size as u64).saturating_add(LINE as u64)
}

impl<T: Clone + Default> Lines<T> {
    /// Allocates room for `len` values, all zero; `what` names them in the error.
    pub(crate) fn new(what: &'static str, len: usize) -> Result<Self, Error> {
        let spare = LINE / size_of::<T>();
        let values = memory::filled(what, len.saturating_add(spare), T::default())?;
        let first = values.as_ptr().align_offset(LINE).min(spare);
        Ok(Self { values, first, len })
    }

    /// Allocates nothing.
    pub(crate) fn none() -> Self {
        Self { values: Vec::new(), first: 0, len: 0 }
    }

    /// The bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        memory::bytes(&self.values)
    }
}

impl<T> Deref for Lines<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.values[self.first..][..self.len]
    }
}

impl<T> DerefMut for Lines<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.values[self.first..][..self.len]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_value_starts_a_line_and_the_bytes_are_those_held() {
        for len in [0, 1, 63, 64, 1000] {
            let (narrow, wide) = (Lines::<u8>::new("bytes", len).unwrap(), Lines::<u64>::new("words", len).unwrap());
            assert_eq!([narrow.len(), wide.len()], [len; 2]);
            assert_eq!([narrow.as_ptr() as usize % LINE, wide.as_ptr() as usize % LINE], [0, 0]);
            assert_eq!([narrow.bytes(), wide.bytes()], [bytes(len, 1), bytes(len, 8)]);
        }
    }
}
