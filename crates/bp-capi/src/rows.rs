//! Rows of values in the caller's memory.

use std::marker::PhantomData;

use bp_core::Size;

use crate::status::Failure;

/// Rows of values, some bytes apart, whose places were checked.
#[derive(Clone, Copy)]
pub(crate) struct Rows<T> {
    first: *const u8,
    stride: isize,
    size: Size,
    /// Values in a row.
    length: usize,
    kind: PhantomData<T>,
}

impl<T: Copy> Rows<T> {
    /// Rows of `channels` values for each pixel. Messages call them `name`.
    pub(crate) fn new(
        name: &str,
        first: *const T,
        stride: isize,
        size: Size,
        channels: usize,
    ) -> Result<Self, Failure> {
        let (bytes, length) = (size_of::<T>(), size.width * channels);
        let failed = |what: String| Err(Failure::input(format!("{name}: {what}")));
        if first.is_null() {
            return failed("the pointer is null".to_owned());
        }
        if !first.is_aligned() || stride % bytes as isize != 0 {
            return failed(format!("pointer and stride must be multiples of {bytes}"));
        }
        let reach = stride.checked_mul(size.height as isize - 1);
        if size.height > 1 && stride.unsigned_abs() < length * bytes || reach.is_none() {
            return failed(format!("rows have {} bytes, which does not fit the stride {stride}", length * bytes));
        }
        Ok(Self { first: first.cast(), stride, size, length, kind: PhantomData })
    }

    /// The values of row `y`.
    ///
    /// # Safety
    /// The caller of the library must have promised that all rows are readable.
    pub(crate) unsafe fn read(&self, y: usize) -> impl Iterator<Item = T> + Clone {
        let row = self.row(y);
        // SAFETY: the promise; the address is aligned, and its distance was checked.
        (0..self.length).map(move |x| unsafe { row.add(x).read() })
    }

    /// Writes values, `[height][width]`, into the rows. They need not hold values yet.
    ///
    /// # Safety
    /// The caller of the library must have promised that all rows are writable.
    pub(crate) unsafe fn write(&self, values: impl IntoIterator<Item = T>) {
        let places = (0..self.size.height).flat_map(|y| (0..self.length).map(move |x| (x, y)));
        for ((x, y), value) in places.zip(values) {
            // SAFETY: the promise; the address is aligned, and its distance was checked.
            unsafe { self.row(y).add(x).cast_mut().write(value) };
        }
    }

    fn row(&self, y: usize) -> *const T {
        self.first.wrapping_offset(y as isize * self.stride).cast()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Miri runs this, too: it would notice a value outside the rows, or one that was never written.
    #[test]
    #[expect(unsafe_code, reason = "as the interface calls them")]
    fn rows_lie_apart_and_may_end_where_memory_begins() -> Result<(), String> {
        let size = Size { width: 2, height: 3 };
        let values: Vec<u16> = (0..6).collect();
        for stride in [2, 5, -2, -5_isize] {
            let last = 2 * stride.unsigned_abs();
            let mut memory = vec![u16::MAX; last + 2];
            let first = if stride < 0 { last } else { 0 };
            let start = memory.as_mut_ptr().wrapping_add(first);
            let rows = Rows::new("rows", start, 2 * stride, size, 1).map_err(|Failure(_, what)| what)?;
            // SAFETY: the rows lie in the memory.
            unsafe { rows.write(values.iter().copied()) };
            // SAFETY: as above.
            let read: Vec<u16> = (0..3).flat_map(|y| unsafe { rows.read(y) }).collect();
            assert_eq!(read, values, "{stride}");
            assert_eq!(memory.iter().filter(|&&value| value == u16::MAX).count(), memory.len() - 6, "{stride}");
        }
        Ok(())
    }
}
