//! Failures of experiments: a message that says what to do, and a kind that says who can fix it.

use std::path::Path;

/// Why an experiment ended without its result.
#[derive(Debug, thiserror::Error)]
#[error("{message}")]
pub struct Failure {
    kind: Kind,
    message: String,
}

/// What went wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Anything else, such as a full disk or an output that cannot be written.
    Other,
    /// Options that contradict each other.
    Usage,
    /// A file that is missing, broken or does not fit.
    Input,
    /// Something is worse than a baseline allows.
    Gate,
    /// A backend or device that is not available.
    Unavailable,
    /// A plan that the device cannot run.
    Unsupported,
    /// A device that was lost.
    DeviceLost,
    /// Too little memory.
    OutOfMemory,
    /// The caller asked to stop.
    Interrupted,
}

impl Failure {
    fn new(kind: Kind, message: impl Into<String>) -> Self {
        Self { kind, message: message.into() }
    }

    /// Anything else, such as a full disk or an output that cannot be written.
    pub fn other(message: impl Into<String>) -> Self {
        Self::new(Kind::Other, message)
    }

    /// Options that contradict each other.
    pub fn usage(message: impl Into<String>) -> Self {
        Self::new(Kind::Usage, message)
    }

    /// A file that is missing, broken or does not fit.
    pub fn input(message: impl Into<String>) -> Self {
        Self::new(Kind::Input, message)
    }

    /// A file that cannot be read.
    pub fn reading(path: &Path, error: &dyn std::fmt::Display) -> Self {
        Self::input(format!("{}: {error}", path.display()))
    }

    /// A file that cannot be written.
    pub fn writing(path: &Path, error: &dyn std::fmt::Display) -> Self {
        Self::other(format!("cannot write {}: {error}", path.display()))
    }

    /// Something is worse than a baseline allows.
    pub fn gate(message: impl Into<String>) -> Self {
        Self::new(Kind::Gate, message)
    }

    /// Too little memory.
    pub fn out_of_memory(message: impl Into<String>) -> Self {
        Self::new(Kind::OutOfMemory, message)
    }

    /// A backend or device that is not available.
    pub fn unavailable(message: impl Into<String>) -> Self {
        Self::new(Kind::Unavailable, message)
    }

    /// The same failure, with `what` in front of its message.
    pub fn of(self, what: &str) -> Self {
        Self { message: format!("{what}: {}", self.message), ..self }
    }

    /// Stopped by the user.
    pub fn interrupted() -> Self {
        Self::new(Kind::Interrupted, "interrupted")
    }

    /// What went wrong, and so who can fix it.
    #[must_use]
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Whether the device is available but cannot run the plan.
    pub fn is_beyond_device(&self) -> bool {
        matches!(self.kind, Kind::Unsupported | Kind::OutOfMemory)
    }

    /// The cause, which only distinguishes a lost device from everything else.
    pub fn cause(&self) -> bp_stereo::Cause {
        if self.kind == Kind::DeviceLost { bp_stereo::Cause::DeviceLost } else { bp_stereo::Cause::System }
    }

    /// Whether the user stopped the program.
    pub fn is_interrupted(&self) -> bool {
        self.kind == Kind::Interrupted
    }
}

impl From<bp_core::Error> for Failure {
    fn from(error: bp_core::Error) -> Self {
        bp_stereo::Error::from(error).into()
    }
}

impl From<bp_io::Error> for Failure {
    fn from(error: bp_io::Error) -> Self {
        bp_stereo::Error::from(error).into()
    }
}

impl From<bp_stereo::Error> for Failure {
    fn from(error: bp_stereo::Error) -> Self {
        use bp_stereo::Cause;
        let kind = match error.cause() {
            Cause::Options => Kind::Usage,
            Cause::Input => Kind::Input,
            Cause::Unavailable => Kind::Unavailable,
            Cause::Unsupported => Kind::Unsupported,
            Cause::DeviceLost => Kind::DeviceLost,
            Cause::Memory => Kind::OutOfMemory,
            Cause::System => Kind::Other,
            Cause::Stopped => Kind::Interrupted,
        };
        Self::new(kind, error.to_string())
    }
}

impl From<bp_stereo::Stopped> for Failure {
    fn from(_: bp_stereo::Stopped) -> Self {
        Self::interrupted()
    }
}
