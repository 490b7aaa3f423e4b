//! What happens when the system has no more memory.
//!
//! Where a buffer may be large, the libraries ask for it in a way that can fail, and return an error. Everything else, such as the
//! names of files and the tables of decoders, comes from collections that abort the program if there is no memory for them. No
//! stable Rust changes that. This file lets that abort, and no other, end like an error: with a message, the exit code for
//! a lack of memory and no temporary file.

use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
};

/// The system's allocator. It remembers failures, so that an abort for lack of memory is known from others.
struct Remembering;

#[global_allocator]
static ALLOCATOR: Remembering = Remembering;

thread_local! {
    /// The bytes of this thread's last allocation that failed, until it gets as many. Before an abort Rust prints a message, for
    /// which it allocates a little.
    static LACKING: Cell<usize> = const { Cell::new(usize::MAX) };
}

fn remembered(memory: *mut u8, bytes: usize) -> *mut u8 {
    if memory.is_null() {
        LACKING.set(bytes);
    } else if bytes >= LACKING.get() {
        LACKING.set(usize::MAX);
    }
    memory
}

#[expect(unsafe_code, reason = "an allocator is unsafe to implement")]
// SAFETY: every call goes to the system's allocator, whose answer is returned as it is.
unsafe impl GlobalAlloc for Remembering {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the rules of `System`, which are those of this function.
        remembered(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as above.
        remembered(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, bytes: usize) -> *mut u8 {
        // SAFETY: as above.
        remembered(unsafe { System.realloc(memory, layout, bytes) }, bytes)
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(memory, layout) }
    }
}

/// Makes an abort for lack of memory end the program as an error does.
#[cfg(unix)]
#[expect(unsafe_code, reason = "only the C library can catch an abort")]
pub(crate) fn set_up() {
    let handler = at_abort as extern "C" fn(libc::c_int);
    // SAFETY: the handler is a function of the right type. See there for what it does.
    let _ = unsafe { libc::signal(libc::SIGABRT, handler as libc::sighandler_t) };
}

/// Elsewhere the program ends as Rust ends it.
#[cfg(not(unix))]
pub(crate) fn set_up() {}

/// Runs on the thread that aborts, between two of its calls and not within one of the C library, so that it may do what that
/// thread may. It returns from all other aborts, which then end the program.
#[cfg(unix)]
#[expect(unsafe_code, reason = "the program must end without what normally runs at its end, which may need memory")]
extern "C" fn at_abort(_signal: libc::c_int) {
    use std::io::Write as _;

    if LACKING.get() == usize::MAX {
        return;
    }
    remove_temporaries();
    let what =
        "bp: out of memory; free some, or raise the limit that the system sets, and run the same command again\n";
    let _ = std::io::stderr().write_all(what.as_bytes());
    // SAFETY: this ends the program at once.
    unsafe { libc::_exit(crate::failure::OUT_OF_MEMORY.into()) };
}

/// Removes the temporary files that the program has open: those that it is writing. Files that it reads are not touched, whatever
/// their names. Other threads may be about to open more, so from now on the system lets nobody open anything; what is being opened
/// is waited for.
#[cfg(unix)]
#[expect(unsafe_code, reason = "only the C library can set limits and tell how a file is open")]
fn remove_temporaries() {
    use std::{fs, path::Path, thread, time::Duration};

    /// The most files that are looked at: many more than the program has open.
    const MOST_FILES: libc::rlim_t = 1 << 16;
    /// How long a call of the system that opens a file may take.
    const OPENING: Duration = Duration::from_millis(5);
    let mut limit = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
    let none = limit;
    // SAFETY: both are valid limits.
    let _ = unsafe {
        libc::getrlimit(libc::RLIMIT_NOFILE, &raw mut limit);
        libc::setrlimit(libc::RLIMIT_NOFILE, &raw const none)
    };
    thread::sleep(OPENING);
    let is_written = |number: libc::c_int| {
        // SAFETY: this only asks, and fails for a number that is not open any more.
        let flags = unsafe { libc::fcntl(number, libc::F_GETFL) };
        flags >= 0 && flags & libc::O_ACCMODE != libc::O_RDONLY
    };
    for number in 0..limit.rlim_cur.min(MOST_FILES) as libc::c_int {
        let Ok(path) = Path::new(&format!("/proc/self/fd/{number}")).read_link() else { continue };
        let name = path.file_name().unwrap_or_default().as_encoded_bytes();
        if name.starts_with(bp_io::Files::PREFIX.as_bytes()) && is_written(number) {
            let _ = fs::remove_file(path);
        }
    }
}
