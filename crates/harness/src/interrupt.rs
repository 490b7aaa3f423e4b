//! Ctrl-C and progress: a run is stopped between two steps (all loops of a grid that is swept are one), so that nothing
//! is left half done.

use std::{
    ops::ControlFlow,
    sync::{LazyLock, Mutex, OnceLock, PoisonError},
    time::Duration,
};

use indicatif::{ProgressDrawTarget, ProgressStyle};

use crate::{
    failure::Failure,
    notes,
    watch::{Event, Stop, Watch},
};

static STOP: LazyLock<Stop> = LazyLock::new(Stop::default);

/// The bar that is shown: the first of those that there are, as a batch has one that its pairs have theirs below.
static SHOWN: Mutex<Option<indicatif::ProgressBar>> = Mutex::new(None);

/// Makes Ctrl-C and SIGTERM stop the program at the next step, and a second one at once. For commands that take steps;
/// others are stopped by the system.
pub(crate) fn listen() -> Result<(), Failure> {
    let stop = || {
        if STOP.stop() {
            std::process::exit(Failure::interrupted().code().into());
        }
    };
    let reason = |error| match error {
        ctrlc::Error::System(error) => error.to_string(),
        other => other.to_string(),
    };
    ctrlc::set_handler(stop).map_err(|error| Failure::other(format!("cannot handle Ctrl-C: {}", reason(error))))
}

/// Fails where the user has asked to stop.
pub(crate) fn check() -> Result<(), Failure> {
    if STOP.is_stopped() { Err(Failure::interrupted()) } else { Ok(()) }
}

/// Writes to standard error where a bar may be shown.
pub(crate) fn beside_bar(write: impl FnOnce()) {
    let bar = SHOWN.lock().unwrap_or_else(PoisonError::into_inner).clone();
    bar.unwrap_or_else(indicatif::ProgressBar::hidden).suspend(write);
}

/// Does work whose events go to standard error, and which Ctrl-C stops if [`listen`] was called.
pub(crate) fn watched<T>(work: impl FnOnce(&Watch<'_>) -> T) -> T {
    let bar = OnceLock::new();
    work(&Watch::new(&|event| show(event, &bar), &STOP))
}

/// Shows an event. The bar appears with the first progress.
fn show(event: Event<'_>, bar: &OnceLock<ProgressBar>) {
    match event {
        Event::Progress { done, total } => {
            let bar = bar.get_or_init(|| {
                let bar = ProgressBar::new(total);
                bar.resume_at(done);
                bar
            });
            bar.set_total(total);
            bar.bar.set_position(done);
            if done >= total {
                bar.finish();
            }
        }
        Event::Task(task) => {
            if let Some(bar) = bar.get() {
                bar.message(task.split_whitespace().collect::<Vec<_>>().join(" "));
            }
        }
        Event::Line(line) => {
            if !notes::is_quiet() {
                notes::tell(line);
            }
        }
        Event::Note(line) => notes::note(line),
        Event::Warning(what) => notes::warn(what),
    }
}

/// A bar on standard error, with the time left; not drawn where that is no terminal, where only errors are told, or where
/// another is shown.
pub(crate) struct ProgressBar {
    bar: indicatif::ProgressBar,
    is_shown: bool,
}

impl ProgressBar {
    /// A bar for so much work: message entries, pairs.
    pub(crate) fn new(total: u64) -> Self {
        let mut shown = SHOWN.lock().unwrap_or_else(PoisonError::into_inner);
        if shown.is_some() || notes::is_quiet() {
            return Self { bar: indicatif::ProgressBar::hidden(), is_shown: false };
        }
        let bar = indicatif::ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr_with_hz(5));
        let style = ProgressStyle::with_template("{bar:40} {percent:>3} %  {elapsed} elapsed, {eta} left  {msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        bar.enable_steady_tick(Duration::from_millis(500));
        *shown = Some(bar.clone());
        Self { bar, is_shown: true }
    }

    /// Shows how much is done; breaks where the user has asked to stop.
    pub(crate) fn update(&self, done: u64) -> ControlFlow<()> {
        self.bar.set_position(done);
        if STOP.is_stopped() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    /// Starts from a run that was interrupted after so much: it says nothing about the time left.
    pub(crate) fn resume_at(&self, done: u64) {
        self.bar.set_position(done);
        self.bar.reset_eta();
    }

    /// Corrects how much there is.
    pub(crate) fn set_total(&self, total: u64) {
        self.bar.set_length(total);
    }

    /// Shows what is being done.
    pub(crate) fn message(&self, message: String) {
        self.bar.set_message(message);
    }

    /// Removes the bar.
    pub(crate) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

impl Drop for ProgressBar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
        if self.is_shown {
            *SHOWN.lock().unwrap_or_else(PoisonError::into_inner) = None;
        }
    }
}
