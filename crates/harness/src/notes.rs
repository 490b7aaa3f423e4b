//! What people are told on standard error.

use std::{
    collections::HashSet,
    io::Write as _,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
};

use crate::interrupt;

static QUIET: AtomicBool = AtomicBool::new(false);
static NOTED: Mutex<Option<HashSet<String>>> = Mutex::new(None);

/// Leaves out notes, warnings and progress from now on; errors are told.
pub(crate) fn be_quiet() {
    QUIET.store(true, Ordering::Relaxed);
}

/// Whether only errors are told.
pub(crate) fn is_quiet() -> bool {
    QUIET.load(Ordering::Relaxed)
}

/// Prints an error, above the bar where there is one. Where standard error is full or closed there is nobody left to
/// tell.
pub(crate) fn tell(line: &str) {
    interrupt::beside_bar(|| drop(writeln!(std::io::stderr(), "{line}")));
}

/// Tells a note or warning, unless only errors are wanted; one that many pairs give rise to only once.
pub(crate) fn note(line: &str) {
    let mut noted = NOTED.lock().unwrap_or_else(PoisonError::into_inner);
    if !is_quiet() && noted.get_or_insert_default().insert(line.to_owned()) {
        tell(line);
    }
}
