//! What people are told on standard error.

use std::{
    collections::HashSet,
    io::{self, Write},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
};

use crate::bar;

static QUIET: AtomicBool = AtomicBool::new(false);
static NOTED: Mutex<Option<HashSet<String>>> = Mutex::new(None);

/// Tells nothing but errors where `quiet`; logs what the environment variable RUST_LOG asks for, by default nothing.
pub(crate) fn set_up(quiet: bool) {
    QUIET.store(quiet, Ordering::Relaxed);
    let env = env_logger::Env::default().default_filter_or("off");
    let target = env_logger::Target::Pipe(Box::new(BesideBar));
    // Another program that calls this one as a library may log by itself.
    let _ = env_logger::Builder::from_env(env).target(target).try_init();
    // Panics that a reader of files turns into an error need no words of their own.
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |about| {
        if !bp_io::is_caught() {
            hook(about);
        }
    }));
}

/// Standard error, above the bar where there is one.
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

/// Whether only errors are told.
pub(crate) fn is_quiet() -> bool {
    QUIET.load(Ordering::Relaxed)
}

/// Prints an error, above the bar where there is one. Where standard error is full or closed there is nobody left to
/// tell.
pub(crate) fn tell(line: &str) {
    bar::beside_bar(|| drop(writeln!(io::stderr(), "{line}")));
}

/// Tells a note, unless only errors are wanted; one that many pairs give rise to only once.
pub(crate) fn note(line: &str) {
    let mut noted = NOTED.lock().unwrap_or_else(PoisonError::into_inner);
    if !is_quiet() && noted.get_or_insert_default().insert(line.to_owned()) {
        tell(line);
    }
}

/// Keeps a layer of Mesa's Vulkan drivers from complaining on standard error where no desktop runs. All that the layer does is
/// to sort the list of devices.
#[expect(unsafe_code, reason = "the layer takes nothing but a variable of the environment")]
pub(crate) fn quieten_driver() {
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // SAFETY: called first of all, before there is another thread.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    }
}
