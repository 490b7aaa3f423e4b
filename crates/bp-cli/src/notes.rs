//! Messages and logs on standard error.

use std::{
    borrow::Cow,
    collections::HashSet,
    io::{self, Write},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
};

use harness::escape::is_shown;

use crate::bar;

static QUIET: AtomicBool = AtomicBool::new(false);
static NOTED: Mutex<Option<HashSet<String>>> = Mutex::new(None);

/// Sets up messages and logs. If `quiet`, only errors are printed. The environment variable RUST_LOG selects the log,
/// by default none.
pub(crate) fn set_up(quiet: bool) {
    QUIET.store(quiet, Ordering::Relaxed);
    let env = env_logger::Env::default().default_filter_or("off");
    let target = env_logger::Target::Pipe(Box::new(BesideBar));
    // Ignored if a logger is already set.
    let _ = env_logger::Builder::from_env(env).target(target).try_init();
    // A panic that a file reader turns into an error must not print anything.
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |about| {
        if !bp_io::is_caught() {
            hook(about);
        }
    }));
}

/// Standard error, above the progress bar if one is shown.
struct BesideBar;

impl Write for BesideBar {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut written = Ok(0);
        bar::beside_bar(|| written = io::stderr().write(bytes));
        written
    }

    fn flush(&mut self) -> io::Result<()> {
        io::stderr().flush()
    }
}

/// Whether only errors are printed.
pub(crate) fn is_quiet() -> bool {
    QUIET.load(Ordering::Relaxed)
}

/// Prints a line to standard error, above the progress bar if one is shown. Ignores errors: if standard error is full
/// or closed, nobody can read them.
pub(crate) fn tell(line: &str) {
    bar::beside_bar(|| drop(writeln!(io::stderr(), "{}", printable(line))));
}

/// A text in which terminals find nothing to obey. Names of files and texts in them may hold characters that are not only
/// displayed; except for tabs and line breaks, these become escapes such as `\u{1b}`.
pub(crate) fn printable(text: &str) -> Cow<'_, str> {
    let is_obeyed = |c: char| !is_shown(c) && !matches!(c, '\n' | '\t');
    if !text.contains(is_obeyed) {
        return Cow::Borrowed(text);
    }
    let escaped = |c: char| if is_obeyed(c) { c.escape_default().to_string() } else { c.to_string() };
    Cow::Owned(text.chars().map(escaped).collect())
}

/// Prints a note, unless only errors are wanted. A note that several pairs cause is printed once.
pub(crate) fn note(line: &str) {
    let mut noted = NOTED.lock().unwrap_or_else(PoisonError::into_inner);
    if !is_quiet() && noted.get_or_insert_default().insert(line.to_owned()) {
        tell(line);
    }
}

/// Disables a layer of Mesa's Vulkan drivers that prints complaints to standard error if no desktop runs. The layer
/// only sorts the list of devices.
#[expect(unsafe_code, reason = "the layer takes nothing but a variable of the environment")]
pub(crate) fn quieten_driver() {
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // SAFETY: called first in `main`, before any other thread starts.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terminals_find_nothing_to_obey() {
        assert_eq!(printable("a\tb\n\u{e4} 5"), "a\tb\n\u{e4} 5");
        assert_eq!(printable("\x1b]0;x\x07\r\u{9b}2J\u{202e}"), "\\u{1b}]0;x\\u{7}\\r\\u{9b}2J\\u{202e}");
    }
}
