//! The C library's heap.

/// Buffers of at least this many bytes go back to the system as soon as they are freed. Mapping their pages anew costs
/// little compared with the work on them. Smaller buffers are too small to matter.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const LARGE: i32 = 64 << 10;

/// Makes freed memory go back to the system. By default, glibc keeps buffers of up to 32 MiB once it has seen one
/// freed, so the program would exceed its memory limit. It also reserves 64 MiB of addresses for every thread, which count
/// where the system limits those (`ulimit -v`); one heap for all threads is enough here.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[expect(unsafe_code, reason = "only the C library can set its own allocator")]
pub(crate) fn hold_little() {
    // SAFETY: `mallopt` takes two numbers and may be called at any time. If it fails, the setting does not change.
    let _ = unsafe { [libc::mallopt(libc::M_MMAP_THRESHOLD, LARGE), libc::mallopt(libc::M_ARENA_MAX, 1)] };
}

/// Other C libraries return large buffers by themselves.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub(crate) fn hold_little() {}
