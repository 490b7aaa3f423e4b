//! Images that stay in NumPy's memory.

#![expect(unsafe_code, reason = "NumPy's memory is read while other Python threads run")]

use std::slice;

use bp_core::{Error, Image, Size};
use numpy::{PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;

/// The bytes of an array without gaps, and the array, which keeps them.
struct Lent {
    start: *const u8,
    length: usize,
    _array: Py<PyArrayDyn<u8>>,
}

// SAFETY: the bytes stay where they are as long as the array lives, whichever thread reads them.
unsafe impl Send for Lent {}

impl AsRef<[u8]> for Lent {
    fn as_ref(&self) -> &[u8] {
        // SAFETY: the array holds that many bytes, and NumPy neither frees nor moves them while somebody holds the array. As for all
        // functions that let other threads run while they read an array, its owner must not write to it meanwhile.
        unsafe { slice::from_raw_parts(self.start, self.length) }
    }
}

/// The image that an array `[height][width]` or `[height][width][channels]` holds, read in its place. `None` if its values do not
/// lie side by side.
pub(crate) fn lent(size: Size, array: &Bound<'_, PyArrayDyn<u8>>) -> Option<Result<Image, Error>> {
    if !array.is_c_contiguous() {
        return None;
    }
    let lent = Lent { start: array.data().cast_const(), length: array.len(), _array: array.clone().unbind() };
    let Size { width, height } = size;
    let is_coloured = matches!(array.shape(), [_, _, 3]);
    Some(if is_coloured { Image::lent_rgb(width, height, lent) } else { Image::lent_grey(width, height, lent) })
}
