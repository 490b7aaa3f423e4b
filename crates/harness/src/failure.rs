//! How the program fails: a message that says what to do, and an exit code that says who can mend it.

use std::{io, path::Path};

use crate::watch::Stopped;

/// Why a command ended without its result.
#[derive(Debug, thiserror::Error)]
#[error("{message}")]
pub(crate) struct Failure {
    kind: Kind,
    message: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    ReaderGone,
    Other,
    Usage,
    Input,
    Gate,
    Unavailable,
    Unsupported,
    DeviceLost,
    OutOfMemory,
    Interrupted,
}

/// What the exit codes mean, in their order; help, man page and README take it from here.
pub(crate) const EXIT_CODES: [(u8, &str); 8] = [
    (0, "done"),
    (1, "other"),
    (2, "usage"),
    (3, "input"),
    (4, "the gate failed"),
    (5, "backend or device unavailable or unable to run the plan"),
    (6, "out of memory"),
    (130, "interrupted"),
];

/// The same as a sentence.
pub(crate) fn exit_codes() -> String {
    let codes: Vec<String> = EXIT_CODES.iter().map(|(code, what)| format!("{code} {what}")).collect();
    format!("Exit codes: {}.", codes.join(", "))
}

impl Failure {
    fn new(kind: Kind, message: impl Into<String>) -> Self {
        Self { kind, message: message.into() }
    }

    /// The fault of none of the below: a full disk, an output that cannot be written.
    pub(crate) fn other(message: impl Into<String>) -> Self {
        Self::new(Kind::Other, message)
    }

    /// Options that contradict each other.
    pub(crate) fn usage(message: impl Into<String>) -> Self {
        Self::new(Kind::Usage, message)
    }

    /// A file that is missing, broken or does not fit.
    pub(crate) fn input(message: impl Into<String>) -> Self {
        Self::new(Kind::Input, message)
    }

    /// A file that cannot be read.
    pub(crate) fn reading(path: &Path, error: &dyn std::fmt::Display) -> Self {
        Self::input(format!("{}: {error}", path.display()))
    }

    /// A file that cannot be written.
    pub(crate) fn writing(path: &Path, error: &dyn std::fmt::Display) -> Self {
        Self::other(format!("cannot write {}: {error}", path.display()))
    }

    /// Something is worse than a baseline allows.
    pub(crate) fn gate(message: impl Into<String>) -> Self {
        Self::new(Kind::Gate, message)
    }

    /// Too little memory.
    pub(crate) fn out_of_memory(message: impl Into<String>) -> Self {
        Self::new(Kind::OutOfMemory, message)
    }

    /// A backend or device that is not there.
    pub(crate) fn unavailable(message: impl Into<String>) -> Self {
        Self::new(Kind::Unavailable, message)
    }

    /// The same, told of something.
    pub(crate) fn of(self, what: &str) -> Self {
        Self { message: format!("{what}: {}", self.message), ..self }
    }

    /// Stopped by the user.
    pub(crate) fn interrupted() -> Self {
        Self::new(Kind::Interrupted, "interrupted")
    }

    /// The exit code.
    #[must_use]
    pub(crate) fn code(&self) -> u8 {
        match self.kind {
            Kind::ReaderGone => 0,
            Kind::Other => 1,
            Kind::Usage => 2,
            Kind::Input => 3,
            Kind::Gate => 4,
            Kind::Unavailable | Kind::Unsupported | Kind::DeviceLost => 5,
            Kind::OutOfMemory => 6,
            Kind::Interrupted => 130,
        }
    }

    /// Whether the device is there, but the plan is more than it can run.
    pub(crate) fn is_beyond_device(&self) -> bool {
        matches!(self.kind, Kind::Unsupported | Kind::OutOfMemory)
    }

    /// Whether the device went away: until it is opened again it refuses all further work.
    pub(crate) fn is_device_lost(&self) -> bool {
        self.kind == Kind::DeviceLost
    }

    /// Whether the user stopped the program.
    pub(crate) fn is_interrupted(&self) -> bool {
        self.kind == Kind::Interrupted
    }
}

impl From<bp_core::Error> for Failure {
    fn from(error: bp_core::Error) -> Self {
        let kind = match &error {
            bp_core::Error::Stopped => Kind::Interrupted,
            bp_core::Error::OutOfMemory { .. } => Kind::OutOfMemory,
            bp_core::Error::Unsupported { .. } => Kind::Unsupported,
            bp_core::Error::Unavailable { .. } => Kind::Unavailable,
            bp_core::Error::DeviceLost { .. } | bp_core::Error::Timeout { .. } => Kind::DeviceLost,
            bp_core::Error::Plan(_)
            | bp_core::Error::Calibration(_)
            | bp_core::Error::Labels { .. }
            | bp_core::Error::Truncation { .. }
            | bp_core::Error::MinDisparity { .. } => Kind::Usage,
            bp_core::Error::Empty { .. }
            | bp_core::Error::TooLarge { .. }
            | bp_core::Error::PixelCount { .. }
            | bp_core::Error::SizesDiffer { .. }
            | bp_core::Error::WrongSize { .. } => Kind::Input,
            _ => Kind::Other,
        };
        Self::new(kind, error.to_string())
    }
}

impl From<Stopped> for Failure {
    fn from(_: Stopped) -> Self {
        Self::interrupted()
    }
}

/// Standard output that cannot be written to: a full disk, say. A reader that closed its end, as `head` does, has what
/// it wanted.
impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        let kind = if error.kind() == io::ErrorKind::BrokenPipe { Kind::ReaderGone } else { Kind::Other };
        Self::new(kind, format!("cannot write to standard output: {error}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_readme_lists_the_exit_codes() {
        let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
        let readme = include_str!("../../../README.md");
        assert!(words(readme).contains(&exit_codes()), "{}", exit_codes());
    }
}
