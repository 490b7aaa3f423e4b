//! Ctrl-C stops work between two steps, so that nothing is left half done.

use std::sync::LazyLock;

use bp_stereo::Stop;

use crate::failure::Failure;

/// Set by Ctrl-C and SIGTERM.
pub(crate) static STOP: LazyLock<Stop> = LazyLock::new(Stop::default);

/// Whether the user asked to stop.
pub(crate) fn is_stopped() -> bool {
    STOP.is_stopped()
}

/// Makes a write beyond the largest size that the system allows a file (`ulimit -f`) fail like one on a full disk. By default
/// it would end the program, which would leave a temporary file.
#[cfg(unix)]
#[expect(unsafe_code, reason = "only the C library can ignore a signal")]
pub(crate) fn survive_size_limit() {
    // SAFETY: the signal is ignored from the start, and no handler runs.
    let _ = unsafe { libc::signal(libc::SIGXFSZ, libc::SIG_IGN) };
}

/// Other systems have no such limit.
#[cfg(not(unix))]
pub(crate) fn survive_size_limit() {}

/// Makes Ctrl-C and SIGTERM stop the program at the next step. A second signal stops it at once. Commands without steps
/// do not call this; the system stops them.
pub(crate) fn listen() -> Result<(), Failure> {
    let stop = || {
        if STOP.stop() {
            std::process::exit(Failure::interrupted().code().into());
        }
    };
    let reason = |error| match error {
        ctrlc::Error::System(error) => error.to_string(),
        other => other.to_string(),
    };
    ctrlc::set_handler(stop).map_err(|error| Failure::other(format!("cannot handle Ctrl-C: {}", reason(error))))
}
