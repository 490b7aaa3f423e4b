//! Errors, sorted by who can fix them.

use bytesize::ByteSize;

use crate::watch::Stopped;

/// An error of this crate. Messages name options by their field, such as `` `max_memory` ``; a front end may replace
/// these names with its own.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An error of the model, a plan, a backend or a device.
    #[error(transparent)]
    Core(bp_core::Error),
    /// An error about a file.
    #[error(transparent)]
    File(#[from] bp_io::Error),
    /// Options that contradict each other or are impossible.
    #[error("{0}")]
    Options(String),
    /// Images, lists or patterns that cannot be used.
    #[error("{0}")]
    Input(String),
    /// Something that cannot be written, or threads that cannot be started.
    #[error("{0}")]
    System(String),
    /// A backend or device that does not exist or cannot be opened.
    #[error("{0}")]
    Unavailable(String),
    /// The work needs more memory than is allowed or free.
    #[error("needs at least {}, but only {} is {reason}; {advice}", iec_or_more(*needed), iec(*available))]
    OutOfMemory {
        /// Bytes needed.
        needed: u64,
        /// Bytes that may be used.
        available: u64,
        /// The source of this limit, in words such as "available" or "allowed by `max_memory`".
        reason: &'static str,
        /// How to need less.
        advice: String,
    },
    /// The caller's [`crate::Stop`] asked to stop.
    #[error("interrupted")]
    Stopped,
    /// An error together with its subject.
    #[error("{what}: {source}")]
    Of {
        /// The subject: a file, a pair or a device.
        what: String,
        /// The error.
        source: Box<Error>,
    },
}

/// Who can fix an [`Error`], and how.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Cause {
    /// The caller, with other options.
    Options,
    /// The caller, with other files or images.
    Input,
    /// The caller, with another device or backend.
    Unavailable,
    /// The caller, with another device or a smaller plan: the device works, but is too small for this plan.
    Unsupported,
    /// The caller, by opening the device again: it was lost.
    DeviceLost,
    /// The caller, with a smaller problem or more memory.
    Memory,
    /// The administrator of the machine: a full disk, missing permissions.
    System,
    /// Nobody: the caller asked to stop.
    Stopped,
}

impl Error {
    /// Who can fix it.
    #[must_use]
    pub fn cause(&self) -> Cause {
        match self {
            Self::Core(error) => cause_of_core(error),
            Self::File(error) => cause_of_file(error),
            Self::Options(_) => Cause::Options,
            Self::Input(_) => Cause::Input,
            Self::System(_) => Cause::System,
            Self::Unavailable(_) => Cause::Unavailable,
            Self::OutOfMemory { .. } => Cause::Memory,
            Self::Stopped => Cause::Stopped,
            Self::Of { source, .. } => source.cause(),
        }
    }

    /// The same error together with its subject: a file, a pair or a device.
    #[must_use]
    pub fn of(self, what: impl Into<String>) -> Self {
        Self::Of { what: what.into(), source: Box::new(self) }
    }
}

fn cause_of_core(error: &bp_core::Error) -> Cause {
    use bp_core::Error as E;
    match error {
        E::Stopped => Cause::Stopped,
        E::OutOfMemory { .. } => Cause::Memory,
        E::Unsupported { .. } => Cause::Unsupported,
        E::Unavailable { .. } => Cause::Unavailable,
        E::DeviceLost { .. } | E::Timeout { .. } => Cause::DeviceLost,
        E::Plan(_) | E::Calibration(_) | E::Labels { .. } | E::Truncation { .. } | E::MinDisparity { .. } => {
            Cause::Options
        }
        E::Empty { .. } | E::TooLarge { .. } | E::PixelCount { .. } | E::SizesDiffer { .. } | E::WrongSize { .. } => {
            Cause::Input
        }
        _ => Cause::System,
    }
}

fn cause_of_file(error: &bp_io::Error) -> Cause {
    match error {
        bp_io::Error::Read { .. } | bp_io::Error::MissingFolder { .. } => Cause::Input,
        bp_io::Error::Request { .. } => Cause::Options,
        bp_io::Error::OutOfMemory { .. } => Cause::Memory,
        _ => Cause::System,
    }
}

impl From<bp_core::Error> for Error {
    /// A stop has one name, wherever it was noticed.
    fn from(error: bp_core::Error) -> Self {
        if error == bp_core::Error::Stopped { Self::Stopped } else { Self::Core(error) }
    }
}

impl From<Stopped> for Error {
    fn from(Stopped: Stopped) -> Self {
        Self::Stopped
    }
}

/// Bytes as text with a binary unit, such as 1.7 GiB.
pub(crate) fn iec(bytes: u64) -> String {
    ByteSize(bytes).display().iec().to_string()
}

/// [`iec`], rounded up to a tenth of the unit, so that the shown amount is enough.
fn iec_or_more(bytes: u64) -> String {
    let unit = 1024_u64.pow(bytes.max(1).ilog(1024));
    let tenths = bytes.saturating_mul(10).div_ceil(unit);
    iec(tenths.saturating_mul(unit).div_ceil(10))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stop_is_the_same_error_wherever_it_was_noticed() {
        assert_eq!([Error::from(bp_core::Error::Stopped), Error::from(Stopped)], [Error::Stopped, Error::Stopped]);
    }

    #[test]
    fn bytes_are_rounded_up_to_what_is_enough() {
        let shown = [0, 1, 1023, 1024, 1025, 21_915_239, 21_915_238].map(iec_or_more);
        assert_eq!(shown, ["0 B", "1 B", "1023 B", "1.0 KiB", "1.1 KiB", "21.0 MiB", "20.9 MiB"]);
    }
}
