//! Memory in large pages, which buffers share.

use std::{
    alloc::{Layout, alloc, dealloc},
    mem::MaybeUninit,
    ptr::NonNull,
    slice,
    sync::{
        Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
};

use range_alloc::RangeAllocator;

use super::{LARGE, ask_for_large_pages};

/// Whether buffers share pages: on Linux, which maps large pages where it is asked to.
const SHARES: bool = cfg!(all(target_os = "linux", not(miri)));

/// Memory begins at multiples of this many bytes.
pub(super) const LINE: usize = align_of::<Line>();

/// Begins at a line of the cache.
#[repr(align(64))]
struct Line;

/// Less than this is not shared.
pub(super) const SMALL: usize = 16 << 10;

/// As much as this is not shared either.
pub(super) const CHUNK: usize = 16 << 20;

/// Whether freed memory goes back to the system at once.
static RETURNS: AtomicBool = AtomicBool::new(false);

/// Makes freed memory go back to the system at once, for programs that must stay within a limit. Buffers of 2 MiB and more then share
/// no pages. Otherwise up to 16 MiB of freed memory are kept, so that no page has to be made anew for the next pair.
pub fn return_freed() {
    RETURNS.store(true, Ordering::Relaxed);
    keep_idle(0);
}

/// The memory of a buffer. Freed when dropped.
pub(super) struct Memory {
    pub(super) start: NonNull<u8>,
    layout: Layout,
    is_shared: bool,
}

impl Memory {
    pub(super) const NONE: Self = Self::own(NonNull::<Line>::dangling().cast(), Layout::new::<()>());

    /// `None` if the allocator refuses.
    pub(super) fn new(bytes: usize) -> Option<Self> {
        if bytes == 0 {
            return Some(Self::NONE);
        }
        let align = if SHARES && bytes >= LARGE { LARGE } else { LINE };
        let layout = Layout::from_size_align(bytes, align).ok()?;
        let not_shared = if RETURNS.load(Ordering::Relaxed) { LARGE } else { CHUNK };
        if SHARES && (SMALL..not_shared).contains(&bytes) {
            return Some(Self { start: take(bytes)?, layout, is_shared: true });
        }
        if bytes >= CHUNK {
            keep_idle(0);
        }
        Some(Self::own(allocate(layout)?, layout))
    }

    /// Memory that was allocated with this layout, as a vector's is, and that nobody else may free.
    pub(super) const fn own(start: NonNull<u8>, layout: Layout) -> Self {
        Self { start, layout, is_shared: false }
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        if self.is_shared {
            give_back(self.start, self.layout.size());
        } else {
            free(self.start, self.layout);
        }
    }
}

#[expect(unsafe_code, reason = "vectors cannot begin at large pages")]
fn allocate(layout: Layout) -> Option<NonNull<u8>> {
    // SAFETY: nobody asks for 0 bytes.
    let start = NonNull::new(unsafe { alloc(layout) })?;
    // SAFETY: this memory was just allocated.
    ask_for_large_pages(unsafe { slice::from_raw_parts_mut(start.cast::<MaybeUninit<u8>>().as_ptr(), layout.size()) });
    Some(start)
}

#[expect(unsafe_code, reason = "the counterpart of `allocate`")]
fn free(start: NonNull<u8>, layout: Layout) {
    if layout.size() > 0 {
        // SAFETY: it was allocated with this layout, and its owner is gone.
        unsafe { dealloc(start.as_ptr(), layout) }
    }
}

/// Memory that several buffers share.
struct Chunk {
    start: NonNull<u8>,
    /// Lines that no buffer holds.
    lines: RangeAllocator<usize>,
}

// SAFETY: nothing is read or written by way of this pointer.
#[expect(unsafe_code, reason = "a pointer is not")]
unsafe impl Send for Chunk {}

/// All that is shared. There are few buffers, and each is allocated once.
static CHUNKS: Mutex<Vec<Chunk>> = Mutex::new(Vec::new());

fn chunks() -> MutexGuard<'static, Vec<Chunk>> {
    CHUNKS.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Chunk {
    const LAYOUT: Layout = match Layout::from_size_align(CHUNK, LARGE) {
        Ok(layout) => layout,
        Err(_) => panic!("an alignment is a power of two"),
    };

    fn new() -> Option<Self> {
        Some(Self { start: allocate(Self::LAYOUT)?, lines: RangeAllocator::new(0..CHUNK / LINE) })
    }

    fn take(&mut self, bytes: usize) -> Option<NonNull<u8>> {
        let lines = self.lines.allocate_range(bytes.div_ceil(LINE)).ok()?;
        NonNull::new(self.start.as_ptr().wrapping_add(LINE * lines.start))
    }

    /// The lines of a buffer, if they are in this chunk.
    fn first_line(&self, start: NonNull<u8>) -> Option<usize> {
        let bytes = start.addr().get().checked_sub(self.start.addr().get())?;
        Some(bytes / LINE).filter(|_| bytes < CHUNK)
    }
}

/// Takes shared memory. `None` if the allocator refuses.
fn take(bytes: usize) -> Option<NonNull<u8>> {
    let mut chunks = chunks();
    if let Some(start) = chunks.iter_mut().find_map(|chunk| chunk.take(bytes)) {
        return Some(start);
    }
    let mut chunk = Chunk::new()?;
    let start = chunk.take(bytes);
    chunks.push(chunk);
    start
}

/// Returns shared memory. The system gets back chunks that nobody shares any more, except for one: the next pair takes it, and
/// pages that come back from the system are cleared first.
fn give_back(start: NonNull<u8>, bytes: usize) {
    let mut chunks = chunks();
    let found = chunks.iter_mut().find_map(|chunk| Some((chunk.first_line(start)?, chunk)));
    let Some((first, chunk)) = found else { return };
    chunk.lines.free_range(first..first + bytes.div_ceil(LINE));
    drop(chunks);
    keep_idle(usize::from(!RETURNS.load(Ordering::Relaxed)));
}

/// Returns chunks that nobody shares to the system, except for so many.
fn keep_idle(most: usize) {
    let mut idle = 0;
    chunks().retain(|chunk| {
        idle += usize::from(chunk.lines.is_empty());
        let is_kept = !chunk.lines.is_empty() || idle <= most;
        if !is_kept {
            free(chunk.start, Chunk::LAYOUT);
        }
        is_kept
    });
}
