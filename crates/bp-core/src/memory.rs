//! Allocation that returns an error instead of ending the program, buffers in large pages, and a measurement of the rate of memory copies.

mod buffer;
mod pages;

use std::{hint::black_box, mem::MaybeUninit, time::Instant};

use rayon::prelude::*;

pub use buffer::Buffer;
pub use pages::return_freed;

use crate::{Error, IsStopped, never, stop::go_on};

/// Allocates a vector of `len` copies of `value`. Writes its memory now, so that no page is first touched while a solve
/// is timed.
///
/// # Errors
/// [`Error::OutOfMemory`] if the allocator refuses; `what` names the buffer in the error.
pub fn filled<T: Clone + Send + Sync>(what: &'static str, len: usize, value: T) -> Result<Vec<T>, Error> {
    filled_unless(&never, what, len, value)
}

/// [`filled`] unless it is stopped: some systems take seconds to hand out much memory.
///
/// # Errors
/// As [`filled`], and [`Error::Stopped`].
pub fn filled_unless<T: Clone + Send + Sync>(
    is_stopped: IsStopped<'_>,
    what: &'static str,
    len: usize,
    value: T,
) -> Result<Vec<T>, Error> {
    let mut values = Vec::new();
    reserve(what, &mut values, len)?;
    let much = (MUCH / size_of::<T>().max(1)).max(1);
    while values.len() < len {
        go_on(is_stopped)?;
        let more = much.min(len - values.len());
        // Most of the time is the system's, to hand out memory. So the threads of a pool ask for much of it together.
        if more == much && rayon::current_thread_index().is_some() {
            values.par_extend(rayon::iter::repeat_n(value.clone(), more));
        } else {
            values.resize(values.len() + more, value.clone());
        }
    }
    Ok(values)
}

/// Lengthens a vector to `len` elements, if it has fewer. It keeps what it allocates. Only this thread writes it, because it may
/// hold a lock: while a thread waits for others, it may take up work that needs the same lock.
///
/// # Errors
/// As [`filled`].
pub fn grow<T: Clone>(what: &'static str, values: &mut Vec<T>, len: usize, value: T) -> Result<(), Error> {
    reserve(what, values, len)?;
    values.resize(len.max(values.len()), value);
    Ok(())
}

/// Makes room for `len` elements in all.
fn reserve<T>(what: &'static str, values: &mut Vec<T>, len: usize) -> Result<(), Error> {
    let needed = (len as u64).saturating_mul(size_of::<T>() as u64);
    let more = len.saturating_sub(values.len());
    values.try_reserve_exact(more).map_err(|_| Error::OutOfMemory { what, needed, available: None })?;
    ask_for_large_pages(values.spare_capacity_mut());
    Ok(())
}

/// Threads share the writing of this many bytes. In between it may be stopped.
const MUCH: usize = 32 << 20;

/// The usual bytes of a large page. Fewer are not worth one.
const LARGE: usize = 2 << 20;

/// Asks Linux to map memory that was not written yet in large pages. The first write to each page costs a visit to the system;
/// with small pages, that takes longer than what images of many megapixels are matched with. No memory is held that was not
/// allocated: large pages lie inside.
#[cfg(all(target_os = "linux", not(miri)))]
#[expect(unsafe_code, reason = "only the C library can tell the system")]
pub(crate) fn ask_for_large_pages<T>(memory: &mut [MaybeUninit<T>]) {
    /// Where pages are larger than this, the advice may be refused.
    const PAGE: usize = 4096;
    let (start, bytes) = (memory.as_mut_ptr().cast::<u8>(), size_of_val(memory));
    let skipped = start.align_offset(PAGE);
    if bytes >= LARGE {
        // SAFETY: the bytes from the first page on are part of the memory, and the advice changes none of them.
        let _ = unsafe { libc::madvise(start.wrapping_add(skipped).cast(), bytes - skipped, libc::MADV_HUGEPAGE) };
    }
}

/// Other systems choose by themselves.
#[cfg(not(all(target_os = "linux", not(miri))))]
pub(crate) fn ask_for_large_pages<T>(_: &mut [MaybeUninit<T>]) {}

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

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    #[test]
    fn a_long_allocation_can_be_stopped_now_and_then() {
        let asked = AtomicUsize::new(0);
        let fill = |len, most| {
            asked.store(0, Ordering::Relaxed);
            filled_unless(&|| asked.fetch_add(1, Ordering::Relaxed) == most, "bytes", len, 7_u8)
                .map(|values| values.len())
        };
        assert_eq!((fill(3 * MUCH + 1, usize::MAX), asked.load(Ordering::Relaxed)), (Ok(3 * MUCH + 1), 4));
        assert_eq!((fill(3 * MUCH + 1, 2), asked.load(Ordering::Relaxed)), (Err(Error::Stopped), 3));
        assert_eq!([fill(0, 0), fill(1, 0)], [Ok(0), Err(Error::Stopped)]);
    }
}
