//! Buffers that share large pages.
//!
//! For every access to memory a processor has to know where the page lies, and it remembers that of a few hundred pages only.
//! In pages of 4 KiB these are a few megabytes, and a sweep works on more arrays than that at a time; on a virtual machine, finding a page
//! takes many times as long as reading the value. So buffers lie next to each other in pages of 2 MiB.

use std::{
    alloc::Layout,
    fmt,
    mem::{ManuallyDrop, MaybeUninit},
    ops::{Deref, DerefMut},
    ptr::NonNull,
    slice,
};

use rayon::prelude::*;

use super::{
    LARGE, MUCH,
    pages::{LINE, Memory},
};
use crate::{Error, IsStopped, never, stop::go_on};

/// A fixed number of values in memory. They begin at a line of the cache; on Linux, buffers lie next to each other in large pages.
pub struct Buffer<T> {
    start: NonNull<T>,
    len: usize,
    /// Frees the memory.
    _memory: Memory,
}

// SAFETY: a buffer owns its values, as a vector does.
#[expect(unsafe_code, reason = "a pointer is neither")]
unsafe impl<T: Send> Send for Buffer<T> {}
// SAFETY: as above.
#[expect(unsafe_code, reason = "a pointer is neither")]
unsafe impl<T: Sync> Sync for Buffer<T> {}

impl<T> Default for Buffer<T> {
    /// Without values.
    fn default() -> Self {
        Self { start: NonNull::dangling(), len: 0, _memory: Memory::NONE }
    }
}

impl<T: Copy + Send + Sync> Buffer<T> {
    /// A buffer of `len` copies of `value`. They are written now, so that no page is first touched while a solve is timed.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] if the allocator refuses; `what` names the buffer in the error.
    pub fn filled(what: &'static str, len: usize, value: T) -> Result<Self, Error> {
        Self::filled_unless(&never, what, len, value)
    }

    /// [`Self::filled`] unless it is stopped: some systems take seconds to hand out much memory.
    ///
    /// # Errors
    /// As [`Self::filled`], and [`Error::Stopped`].
    pub fn filled_unless(is_stopped: IsStopped<'_>, what: &'static str, len: usize, value: T) -> Result<Self, Error> {
        Self::new(what, len, |values| fill(is_stopped, values, value))
    }

    /// A buffer whose values are written by `fill`: all of them, unless it fails.
    fn new(
        what: &'static str,
        len: usize,
        fill: impl FnOnce(&mut [MaybeUninit<T>]) -> Result<(), Error>,
    ) -> Result<Self, Error> {
        const { assert!(align_of::<T>() <= LINE && size_of::<T>() > 0) };
        let memory = len.checked_mul(size_of::<T>()).and_then(Memory::new);
        let needed = (len as u64).saturating_mul(size_of::<T>() as u64);
        let memory = memory.ok_or(Error::OutOfMemory { what, needed, available: None })?;
        let start = memory.start.cast();
        // SAFETY: the memory holds so many values, aligned at lines, and belongs to nobody else.
        #[expect(unsafe_code, reason = "memory of our own")]
        let values = unsafe { slice::from_raw_parts_mut(start.cast().as_ptr(), len) };
        fill(values)?;
        Ok(Self { start, len, _memory: memory })
    }

    /// A buffer with what `map` makes of each value. The threads of the current pool share the work.
    ///
    /// # Errors
    /// As [`Self::filled`].
    pub fn mapped<S: Sync>(what: &'static str, values: &[S], map: impl Fn(&S) -> T + Sync) -> Result<Self, Error> {
        Self::new(what, values.len(), |mapped| {
            let parts = mapped.par_chunks_mut(TOGETHER).zip(values.par_chunks(TOGETHER));
            parts.for_each(|(mapped, values)| {
                for (mapped, value) in mapped.iter_mut().zip(values) {
                    mapped.write(map(value));
                }
            });
            Ok(())
        })
    }

    /// Replaces the buffer by one with copies of `value`, if it has fewer than `len` values. Only this thread writes it, because it
    /// may hold a lock: while a thread waits for others, it may take up work that needs the same lock.
    ///
    /// # Errors
    /// As [`Self::filled`]. The buffer is then empty.
    pub fn grow(&mut self, what: &'static str, len: usize, value: T) -> Result<(), Error> {
        if len > self.len {
            // Its memory may be part of what is allocated next.
            *self = Self::default();
            *self = Self::new(what, len, |values| {
                values.fill(MaybeUninit::new(value));
                Ok(())
            })?;
        }
        Ok(())
    }

    /// The bytes held.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        size_of_val::<[T]>(self) as u64
    }
}

impl<T> Deref for Buffer<T> {
    type Target = [T];

    #[inline]
    #[expect(unsafe_code, reason = "memory of our own")]
    fn deref(&self) -> &[T] {
        // SAFETY: all values were written when the buffer was made, and a borrow of the buffer is one of them.
        unsafe { slice::from_raw_parts(self.start.as_ptr(), self.len) }
    }
}

impl<T> DerefMut for Buffer<T> {
    #[inline]
    #[expect(unsafe_code, reason = "memory of our own")]
    fn deref_mut(&mut self) -> &mut [T] {
        // SAFETY: as above.
        unsafe { slice::from_raw_parts_mut(self.start.as_ptr(), self.len) }
    }
}

impl<T: Copy + Send + Sync> Clone for Buffer<T> {
    /// A copy.
    ///
    /// # Panics
    /// If the allocator refuses. For a vector, the program would end.
    fn clone(&self) -> Self {
        Self::mapped("a copy", self, |&value| value).unwrap_or_else(|error| panic!("{error}"))
    }
}

impl<T: PartialEq> PartialEq for Buffer<T> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl<'a, T> IntoIterator for &'a Buffer<T> {
    type Item = &'a T;
    type IntoIter = slice::Iter<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl<'a, T> IntoIterator for &'a mut Buffer<T> {
    type Item = &'a mut T;
    type IntoIter = slice::IterMut<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter_mut()
    }
}

impl<T: Copy> From<Vec<T>> for Buffer<T> {
    /// The values stay where they are.
    fn from(values: Vec<T>) -> Self {
        let mut values = ManuallyDrop::new(values);
        let layout = Layout::array::<T>(values.capacity()).unwrap_or(Layout::new::<()>());
        let start = NonNull::from(values.as_mut_slice()).cast::<T>();
        Self { start, len: values.len(), _memory: Memory::own(start.cast(), layout) }
    }
}

impl<T> AsRef<[T]> for Buffer<T> {
    fn as_ref(&self) -> &[T] {
        self
    }
}

impl<T: fmt::Debug> fmt::Debug for Buffer<T> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.debug_list().entries(self.iter()).finish()
    }
}

/// Values that one thread makes of others at a time.
const TOGETHER: usize = 1 << 15;

/// Writes memory for the first time. Most of the time is the system's, to hand it out. So the threads of a pool ask for much
/// of it together.
fn fill<T: Copy + Send + Sync>(
    is_stopped: IsStopped<'_>,
    values: &mut [MaybeUninit<T>],
    value: T,
) -> Result<(), Error> {
    let [much, large, little] = [MUCH, LARGE, LARGE / 16].map(|bytes| bytes / size_of::<T>());
    for part in values.chunks_mut(much) {
        go_on(is_stopped)?;
        if part.len() > 4 * little && rayon::current_thread_index().is_some() {
            let together = if part.len() > 4 * large { large } else { little };
            part.par_chunks_mut(together).for_each(|part| part.fill(MaybeUninit::new(value)));
        } else {
            part.fill(MaybeUninit::new(value));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;
    use crate::memory::pages::{CHUNK, SMALL};

    #[test]
    fn buffers_of_all_sizes_keep_their_values_apart() {
        let lens = [0, 1, 63, SMALL - 1, SMALL, SMALL + 1, 1 << 20, CHUNK - 1, CHUNK, CHUNK + 1];
        let mut all: Vec<(u8, Buffer<u8>)> = Vec::new();
        assert!(Buffer::filled("numbers", 0, 1_u64).unwrap().is_empty());
        for round in 0..3_u8 {
            for (index, &len) in lens.iter().enumerate() {
                let value = 16 * round + index as u8;
                let buffer = Buffer::filled("bytes", len, value).unwrap();
                assert_eq!((buffer.len(), buffer.bytes()), (len, len as u64));
                assert!(len == 0 || buffer.as_ptr().addr().is_multiple_of(LINE));
                all.push((value, buffer));
            }
            // Later ones take the memory of these.
            let mut index = 0;
            all.retain(|_| {
                index += 1;
                index % 3 > 0
            });
        }
        assert!(all.iter().all(|(value, buffer)| buffer.iter().all(|byte| byte == value)));
    }

    #[test]
    fn a_vector_becomes_a_buffer_where_it_is() {
        for len in [0, 3, 100_000] {
            let mut values: Vec<u32> = (0..len).collect();
            values.reserve(100);
            let (place, expected) = (values.as_ptr(), values.clone());
            let buffer = Buffer::from(values);
            assert!(buffer.as_ptr() == place && *buffer == *expected);
            let copy = buffer.clone();
            assert!(copy == buffer && (len == 0 || copy.as_ptr() != place));
            let doubled = Buffer::mapped("numbers", &buffer, |value| 2 * u64::from(*value)).unwrap();
            assert!(doubled.iter().zip(&expected).all(|(doubled, &value)| *doubled == 2 * u64::from(value)));
            assert_eq!((doubled.len(), doubled.bytes()), (len as usize, 8 * u64::from(len)));
        }
    }

    #[test]
    fn a_buffer_grows_and_never_shrinks() {
        let mut buffer = Buffer::default();
        assert!(buffer.is_empty());
        for (len, value, expected) in
            [(3, 7_u32, (3, 7)), (2, 8, (3, 7)), (100_000, 9, (100_000, 9)), (4, 1, (100_000, 9))]
        {
            buffer.grow("numbers", len, value).unwrap();
            assert_eq!((buffer.len(), buffer[buffer.len() - 1]), expected);
        }
        assert!(matches!(buffer.grow("numbers", usize::MAX / 2, 0), Err(Error::OutOfMemory { what: "numbers", .. })));
        assert!(buffer.is_empty());
    }

    #[test]
    fn filling_much_memory_can_be_stopped_now_and_then() {
        let asked = AtomicUsize::new(0);
        let fill = |len, most| {
            asked.store(0, Ordering::Relaxed);
            Buffer::filled_unless(&|| asked.fetch_add(1, Ordering::Relaxed) == most, "bytes", len, 7_u8)
                .map(|values| values.len())
        };
        assert_eq!((fill(3 * MUCH + 1, usize::MAX), asked.load(Ordering::Relaxed)), (Ok(3 * MUCH + 1), 4));
        assert_eq!((fill(3 * MUCH + 1, 2), asked.load(Ordering::Relaxed)), (Err(Error::Stopped), 3));
    }
}
