//! Memory in large pages, which buffers share.

use std::{
    alloc::{Layout, alloc, dealloc},
    mem::MaybeUninit,
    ptr::NonNull,
    slice,
    sync::{Mutex, MutexGuard, PoisonError},
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

/// The memory of a buffer. Freed when dropped.
pub(super) struct Memory {
    pub(super) start: NonNull<u8>,
    bytes: usize,
}

impl Memory {
    pub(super) const NONE: Self = Self { start: NonNull::<Line>::dangling().cast(), bytes: 0 };

    /// `None` if the allocator refuses.
    pub(super) fn new(bytes: usize) -> Option<Self> {
        let start = match bytes {
            0 => Self::NONE.start,
            SMALL..CHUNK if SHARES => take(bytes)?,
            _ => allocate(Self::layout(bytes)?)?,
        };
        Some(Self { start, bytes })
    }

    /// The layout of memory that is not shared.
    fn layout(bytes: usize) -> Option<Layout> {
        let align = if SHARES && bytes >= CHUNK { LARGE } else { LINE };
        Layout::from_size_align(bytes, align).ok()
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        match self.bytes {
            0 => {}
            SMALL..CHUNK if SHARES => give_back(self.start, self.bytes),
            bytes => free(self.start, Self::layout(bytes)),
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
fn free(start: NonNull<u8>, layout: Option<Layout>) {
    if let Some(layout) = layout {
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
    const LAYOUT: Option<Layout> = match Layout::from_size_align(CHUNK, LARGE) {
        Ok(layout) => Some(layout),
        Err(_) => None,
    };

    fn new() -> Option<Self> {
        Some(Self { start: allocate(Self::LAYOUT?)?, lines: RangeAllocator::new(0..CHUNK / LINE) })
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

/// Returns shared memory. The system gets back what nobody shares any more.
fn give_back(start: NonNull<u8>, bytes: usize) {
    let mut chunks = chunks();
    let found = chunks.iter_mut().enumerate().find_map(|(index, chunk)| {
        let first = chunk.first_line(start)?;
        chunk.lines.free_range(first..first + bytes.div_ceil(LINE));
        Some((index, chunk.lines.is_empty()))
    });
    if let Some((index, true)) = found {
        free(chunks.remove(index).start, Chunk::LAYOUT);
    }
}
