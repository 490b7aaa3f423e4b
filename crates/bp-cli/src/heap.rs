//! How much freed memory the program keeps.

use bp_core::memory;

/// Makes freed memory go back to the system where memory `is_limited`.
pub(crate) fn set_up(is_limited: bool) {
    if is_limited {
        memory::return_freed();
    }
    set_up_allocator(is_limited);
}

/// What glibc keeps of freed memory: buffers below this many bytes, and this many bytes at the end of the heap.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
struct Kept {
    buffer: i32,
    all: i32,
}

/// Buffers go back to the system as soon as they are freed. Smaller ones are too small to matter.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const LITTLE: Kept = Kept { buffer: 64 << 10, all: 128 << 10 };

/// Buffers of images of up to two megapixels are kept for the next pair: mapping their pages anew takes up to an eighth of a
/// match. `bp_stereo` leaves about as much memory free where nobody limits it.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const MUCH: Kept = Kept { buffer: 8 << 20, all: 32 << 20 };

/// Limits what glibc keeps: by default, buffers of up to 32 MiB once it has seen one freed, so the program would exceed its limit. It also reserves 64 MiB of addresses for every thread, which count
/// where the system limits those (`ulimit -v`); one heap for all threads is enough here.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[expect(unsafe_code, reason = "only the C library can set its own allocator")]
fn set_up_allocator(is_limited: bool) {
    let Kept { buffer, all } = if is_limited { LITTLE } else { MUCH };
    let settings = [(libc::M_MMAP_THRESHOLD, buffer), (libc::M_TRIM_THRESHOLD, all), (libc::M_ARENA_MAX, 1)];
    for (setting, value) in settings {
        // SAFETY: `mallopt` takes two numbers and may be called at any time. If it fails, the setting does not change.
        let _ = unsafe { libc::mallopt(setting, value) };
    }
}

/// Other C libraries return large buffers by themselves.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
fn set_up_allocator(_is_limited: bool) {}
