//! Images that stay in NumPy's memory.

#![expect(unsafe_code, reason = "NumPy's memory is read while other Python threads run")]

use std::slice;

use numpy::{PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;

/// The bytes of an array without gaps, and the array, which keeps them.
pub(crate) struct Lent {
    start: *const u8,
    length: usize,
    _array: Py<PyArrayDyn<u8>>,
}

// SAFETY: the bytes stay where they are as long as the array lives, whichever thread reads them.
unsafe impl Send for Lent {}

impl Lent {
    /// The values of an array side by side, `[height][width]` or `[height][width][channels]`.
    pub(crate) fn of(array: &Bound<'_, PyArrayDyn<u8>>) -> Self {
        debug_assert!(array.is_c_contiguous());
        Self { start: array.data().cast_const(), length: array.len(), _array: array.clone().unbind() }
    }
}

impl AsRef<[u8]> for Lent {
    fn as_ref(&self) -> &[u8] {
        // SAFETY: the array holds that many bytes. While somebody holds the array, NumPy neither frees nor moves them, unless its owner
        // says `resize(..., refcheck=False)`, whose documentation warns of just that. As for all functions that let other threads run
        // while they read an array, the owner must not write to it meanwhile.
        unsafe { slice::from_raw_parts(self.start, self.length) }
    }
}
