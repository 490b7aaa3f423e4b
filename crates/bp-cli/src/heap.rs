//! The C library's heap.

/// Bytes of the buffers that the system gets back as soon as they are freed: above, a page's first touch is nothing
/// beside what is done with it; below, they are too few to matter.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const LARGE: i32 = 4 << 20;

/// Makes memory that is freed go back to the system: glibc keeps buffers of up to 32 MiB once it has seen such freed, so
/// that a program that is told how much it may hold would hold more.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[expect(unsafe_code, reason = "only the C library can set its own allocator")]
pub(crate) fn return_large_buffers() {
    // SAFETY: a setting of the allocator, which takes two numbers and may be changed at any time. Where it is refused,
    // all stays as it was.
    let _ = unsafe { libc::mallopt(libc::M_MMAP_THRESHOLD, LARGE) };
}

/// Other C libraries do by themselves.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub(crate) fn return_large_buffers() {}
