//! Shows the work of the libraries: a progress bar, notes and warnings on standard error. Maps go to standard output.

use std::{
    io::{self, Write as _, stdout},
    sync::{Mutex, PoisonError},
};

use bp_stereo::{Event, Watch};

use crate::{
    bar::ProgressBar,
    failure::{Failure, as_options},
    interrupt::STOP,
    notes::{self, note, printable, tell},
};

/// The progress bar of the current work.
static BAR: Mutex<Option<ProgressBar>> = Mutex::new(None);

/// A watch that shows events and obeys Ctrl-C.
pub(crate) fn watch() -> Watch<'static> {
    Watch::new(&show, &STOP)
}

/// Does work while showing its events, and then removes the bar.
pub(crate) fn watched<T>(work: impl FnOnce(&Watch<'_>) -> T) -> T {
    let outcome = work(&watch());
    finish();
    outcome
}

/// Writes bytes to standard output. A stop ends the wait for a reader that does not read.
pub(crate) fn emit(bytes: Vec<u8>) -> Result<(), Failure> {
    let write = move || {
        let mut out = stdout().lock();
        out.write_all(&bytes)?;
        out.flush()
    };
    let written: io::Result<()> = watch().unless_stopped(write)?;
    Ok(written?)
}

/// Removes the bar.
pub(crate) fn finish() {
    *BAR.lock().unwrap_or_else(PoisonError::into_inner) = None;
}

fn show(event: Event<'_>) {
    match event {
        Event::Progress { done, total } if !notes::is_quiet() => {
            let mut bar = BAR.lock().unwrap_or_else(PoisonError::into_inner);
            let bar = bar.get_or_insert_with(|| ProgressBar::new(total, done));
            bar.show(done, total);
        }
        Event::Task(text) => {
            if let Some(bar) = BAR.lock().unwrap_or_else(PoisonError::into_inner).as_ref() {
                bar.message(printable(&text.split_whitespace().collect::<Vec<_>>().join(" ")).into_owned());
            }
        }
        Event::Line(text) if !notes::is_quiet() => tell(text),
        Event::Note(text) => note(&as_options(text)),
        Event::Warning(text) => warn(&as_options(text)),
        Event::Failed(text) => tell(&as_options(text)),
        _ => {}
    }
}

/// Shows a warning.
pub(crate) fn warn(text: &str) {
    note(&format!("warning: {text}"));
}
