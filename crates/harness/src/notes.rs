//! What people are told on standard error.

use std::{
    collections::HashSet,
    io::{self, Write},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
};

use crate::interrupt;

/// How many warnings of pairs are told: a video may have one for every frame.
const MOST_WARNINGS: usize = 20;

static QUIET: AtomicBool = AtomicBool::new(false);
static WARNED: AtomicUsize = AtomicUsize::new(0);
static NOTED: Mutex<Option<HashSet<String>>> = Mutex::new(None);

/// Tells nothing but errors where `quiet`; logs what the environment variable RUST_LOG asks for, by default nothing.
pub(crate) fn set_up(quiet: bool) {
    QUIET.store(quiet, Ordering::Relaxed);
    let env = env_logger::Env::default().default_filter_or("off");
    let target = env_logger::Target::Pipe(Box::new(BesideBar));
    // Another program that calls this one as a library may log by itself.
    let _ = env_logger::Builder::from_env(env).target(target).try_init();
}

/// Standard error, above the bar where there is one.
struct BesideBar;

impl Write for BesideBar {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut written = Ok(0);
        interrupt::beside_bar(|| written = io::stderr().write(bytes));
        written
    }

    fn flush(&mut self) -> io::Result<()> {
        io::stderr().flush()
    }
}

/// Whether only errors are told.
pub(crate) fn is_quiet() -> bool {
    QUIET.load(Ordering::Relaxed)
}

/// Prints an error, above the bar where there is one. Where standard error is full or closed there is nobody left to
/// tell.
pub(crate) fn tell(line: &str) {
    interrupt::beside_bar(|| drop(writeln!(io::stderr(), "{line}")));
}

/// Tells a note, unless only errors are wanted; one that many pairs give rise to only once.
pub(crate) fn note(line: &str) {
    let mut noted = NOTED.lock().unwrap_or_else(PoisonError::into_inner);
    if !is_quiet() && noted.get_or_insert_default().insert(line.to_owned()) {
        tell(line);
    }
}

/// Tells a warning likewise.
pub(crate) fn warn(what: &str) {
    note(&format!("warning: {what}"));
}

/// Tells a warning that names its pair; of many pairs only the first ones.
pub(crate) fn warn_of_pair(what: &str) {
    match WARNED.fetch_add(1, Ordering::Relaxed) {
        ..MOST_WARNINGS => warn(what),
        MOST_WARNINGS => note("further warnings of images and labels are not told; the pairs' records have them"),
        _ => {}
    }
}
