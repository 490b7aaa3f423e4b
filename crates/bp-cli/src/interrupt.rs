//! Ctrl-C and progress: a run is stopped between two steps (all loops of a grid that is swept are one), so that nothing
//! is left half done.

use std::{
    sync::{Mutex, PoisonError},
    time::Duration,
};

use indicatif::{ProgressDrawTarget, ProgressStyle};

use crate::{failure::Failure, notes, terminal::STOP};

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

/// Writes to standard error where a bar may be shown.
pub(crate) fn beside_bar(write: impl FnOnce()) {
    let bar = SHOWN.lock().unwrap_or_else(PoisonError::into_inner).clone();
    bar.unwrap_or_else(indicatif::ProgressBar::hidden).suspend(write);
}

/// A bar on standard error, with the time left; not drawn where that is no terminal, where only errors are told, or where
/// another is shown.
pub(crate) struct ProgressBar {
    bar: indicatif::ProgressBar,
    is_shown: bool,
}

impl ProgressBar {
    /// A bar for so much work, of which so much was done before: that says nothing about the time left.
    pub(crate) fn new(total: u64, done: u64) -> Self {
        let mut shown = SHOWN.lock().unwrap_or_else(PoisonError::into_inner);
        if shown.is_some() || notes::is_quiet() {
            return Self { bar: indicatif::ProgressBar::hidden(), is_shown: false };
        }
        let bar = indicatif::ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr_with_hz(5));
        let style = ProgressStyle::with_template("{bar:40} {percent:>3} %  {elapsed} elapsed, {eta} left  {msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        bar.enable_steady_tick(Duration::from_millis(500));
        bar.set_position(done);
        bar.reset_eta();
        *shown = Some(bar.clone());
        Self { bar, is_shown: true }
    }

    /// Shows how much is done of how much.
    pub(crate) fn show(&self, done: u64, total: u64) {
        self.bar.set_length(total);
        self.bar.set_position(done);
        if done >= total {
            self.bar.finish_and_clear();
        }
    }

    /// Shows what is being done.
    pub(crate) fn message(&self, message: String) {
        self.bar.set_message(message);
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
