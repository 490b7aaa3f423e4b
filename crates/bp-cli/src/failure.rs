//! Failures of the program. The message says what to do, and the exit code says who can fix it.

use std::io;

use bp_stereo::Cause;
use harness::Kind;

/// Why a command ended without its result.
#[derive(Debug, thiserror::Error)]
#[error("{message}")]
pub(crate) struct Failure {
    code: u8,
    message: String,
}

/// The exit code for a lack of memory.
pub(crate) const OUT_OF_MEMORY: u8 = 6;

/// The exit codes and their meanings. The help, the man page and docs/matching.md use this list.
pub(crate) const EXIT_CODES: [(u8, &str); 8] = [
    (0, "done"),
    (1, "other"),
    (2, "usage"),
    (3, "input"),
    (4, "the gate failed"),
    (5, "backend or device unavailable or unable to run the plan"),
    (OUT_OF_MEMORY, "out of memory"),
    (130, "interrupted"),
];

/// The exit codes as a sentence.
pub(crate) fn exit_codes() -> String {
    let codes: Vec<String> = EXIT_CODES.iter().map(|(code, what)| format!("{code} {what}")).collect();
    format!("Exit codes: {}.", codes.join(", "))
}

impl Failure {
    fn new(code: u8, message: impl Into<String>) -> Self {
        Self { code, message: as_options(&message.into()) }
    }

    /// Any other cause: a full disk, an output that cannot be written.
    pub(crate) fn other(message: impl Into<String>) -> Self {
        Self::new(1, message)
    }

    /// Arguments that contradict each other.
    pub(crate) fn usage(message: impl Into<String>) -> Self {
        Self::new(2, message)
    }

    /// A file that is missing, broken or unsuitable.
    pub(crate) fn input(message: impl Into<String>) -> Self {
        Self::new(3, message)
    }

    /// Something is worse than a baseline allows.
    pub(crate) fn gate(message: impl Into<String>) -> Self {
        Self::new(4, message)
    }

    /// A backend or device that is unavailable.
    pub(crate) fn unavailable(message: impl Into<String>) -> Self {
        Self::new(5, message)
    }

    /// Stopped by the user.
    pub(crate) fn interrupted() -> Self {
        Self::new(130, "interrupted")
    }

    /// The same failure with the name of its subject.
    pub(crate) fn of(self, what: &str) -> Self {
        Self { message: format!("{what}: {}", self.message), ..self }
    }

    /// The exit code.
    pub(crate) fn code(&self) -> u8 {
        self.code
    }
}

/// Replaces the field names with which libraries refer to options, such as `` `max_memory` ``, by `--max-memory`.
pub(crate) fn as_options(message: &str) -> String {
    let is_field = |word: &str| !word.is_empty() && word.bytes().all(|byte| byte.is_ascii_lowercase() || byte == b'_');
    let parts: Vec<&str> = message.split('`').collect();
    let mut text = String::new();
    for (index, part) in parts.iter().enumerate() {
        let is_quoted = index % 2 == 1 && index + 1 < parts.len();
        text += &match (is_quoted, is_field(part)) {
            (true, true) => format!("--{}", part.replace('_', "-")),
            (true, false) => format!("`{part}`"),
            (false, _) => (*part).to_owned(),
        };
    }
    text
}

impl From<bp_stereo::Error> for Failure {
    fn from(error: bp_stereo::Error) -> Self {
        let code = match error.cause() {
            Cause::System => 1,
            Cause::Options => 2,
            Cause::Input => 3,
            Cause::Unavailable | Cause::Unsupported | Cause::DeviceLost => 5,
            Cause::Memory => OUT_OF_MEMORY,
            Cause::Stopped => 130,
        };
        Self::new(code, error.to_string())
    }
}

impl From<harness::Failure> for Failure {
    fn from(failure: harness::Failure) -> Self {
        let code = match failure.kind() {
            Kind::Other => 1,
            Kind::Usage => 2,
            Kind::Input => 3,
            Kind::Gate => 4,
            Kind::Unavailable | Kind::Unsupported | Kind::DeviceLost => 5,
            Kind::OutOfMemory => OUT_OF_MEMORY,
            Kind::Interrupted => 130,
        };
        Self::new(code, failure.to_string())
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

impl From<bp_stereo::Stopped> for Failure {
    fn from(_: bp_stereo::Stopped) -> Self {
        Self::interrupted()
    }
}

/// Standard output cannot be written to, for example because a disk is full. If the reader closed its end, as `head`
/// does, this is not an error.
impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        let code = if error.kind() == io::ErrorKind::BrokenPipe { 0 } else { 1 };
        Self::new(code, format!("cannot write to standard output: {error}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_documentation_lists_the_exit_codes() {
        let page = include_str!("../../../docs/matching.md");
        for (code, meaning) in EXIT_CODES {
            assert!(page.contains(&format!("| {code} | {meaning} |")), "{code} {meaning}");
        }
    }
}
