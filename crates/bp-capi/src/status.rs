//! Outcomes of calls, and their messages.

use std::{
    cell::RefCell,
    ffi::{CStr, CString, c_char},
    panic::{AssertUnwindSafe, catch_unwind},
};

use bp_stereo::{Cause, Error};

/// The outcome of a call. All but `BPSTEREO_STATUS_OK` are failures, sorted by who can fix them.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BpstereoStatus {
    /// Success.
    Ok = 0,
    /// Options that contradict each other, are unknown or impossible.
    Options = 1,
    /// Images or pointers that cannot be used.
    Input = 2,
    /// A backend or device that does not exist or cannot be opened.
    Unavailable = 3,
    /// A device that is too small for the plan.
    Unsupported = 4,
    /// A device that was lost during the work: open a new matcher.
    DeviceLost = 5,
    /// More memory is needed than is allowed or free.
    Memory = 6,
    /// The system or a driver failed.
    System = 7,
    /// `bpstereo_stop` was called.
    Stopped = 8,
    /// A defect of this library. Close the matcher.
    Defect = 9,
}

thread_local! {
    /// The message of this thread's last failure.
    static LAST_ERROR: RefCell<CString> = RefCell::default();
}

/// The message of the last call that failed in this thread, in UTF-8. Valid until the next failure in this thread. Empty if
/// nothing failed yet.
#[unsafe(no_mangle)]
pub extern "C" fn bpstereo_last_error() -> *const c_char {
    LAST_ERROR.try_with(|message| message.borrow().as_ptr()).unwrap_or(c"".as_ptr())
}

/// The version of this library, such as "0.1.0".
#[unsafe(no_mangle)]
pub extern "C" fn bpstereo_version() -> *const c_char {
    const VERSION: &CStr = match CStr::from_bytes_with_nul(concat!(env!("CARGO_PKG_VERSION"), "\0").as_bytes()) {
        Ok(version) => version,
        Err(_) => c"",
    };
    VERSION.as_ptr()
}

/// A failure on its way to C.
pub(crate) struct Failure(pub(crate) BpstereoStatus, pub(crate) String);

impl Failure {
    pub(crate) fn input(message: impl Into<String>) -> Self {
        Self(BpstereoStatus::Input, message.into())
    }
}

impl<E: Into<Error>> From<E> for Failure {
    fn from(error: E) -> Self {
        let error = error.into();
        let status = match error.cause() {
            Cause::Options => BpstereoStatus::Options,
            Cause::Input => BpstereoStatus::Input,
            Cause::Unavailable => BpstereoStatus::Unavailable,
            Cause::Unsupported => BpstereoStatus::Unsupported,
            Cause::DeviceLost => BpstereoStatus::DeviceLost,
            Cause::Memory => BpstereoStatus::Memory,
            Cause::System => BpstereoStatus::System,
            Cause::Stopped => BpstereoStatus::Stopped,
        };
        Self(status, error.to_string())
    }
}

/// Does the work of a call, and keeps the message if it fails. No panic reaches C.
pub(crate) fn status(work: impl FnOnce() -> Result<(), Failure>) -> BpstereoStatus {
    let Failure(status, message) = match catch_unwind(AssertUnwindSafe(work)) {
        Ok(Ok(())) => return BpstereoStatus::Ok,
        Ok(Err(failure)) => failure,
        Err(_) => Failure(BpstereoStatus::Defect, "a defect of bpstereo; please report it".to_owned()),
    };
    let message = CString::new(message.replace('\0', " ")).unwrap_or_default();
    // A thread that is ending has no place for it any more.
    let _ = LAST_ERROR.try_with(|last| last.replace(message));
    status
}
