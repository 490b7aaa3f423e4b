//! The progress bar on standard error, and the lines above it.

use std::{
    sync::{Mutex, PoisonError},
    thread,
    time::Duration,
};

use indicatif::{ProgressDrawTarget, ProgressStyle};

/// The visible progress bar. Only one is drawn at a time.
static SHOWN: Mutex<Option<indicatif::ProgressBar>> = Mutex::new(None);

/// Runs `write`, which writes to standard error, without disturbing the bar.
pub(crate) fn beside_bar(write: impl FnOnce()) {
    let bar = SHOWN.lock().unwrap_or_else(PoisonError::into_inner).clone();
    bar.unwrap_or_else(indicatif::ProgressBar::hidden).suspend(write);
}

/// A bar on standard error with the remaining time. It is hidden if standard error is not a terminal, or if another bar
/// is shown.
pub(crate) struct ProgressBar {
    bar: indicatif::ProgressBar,
    is_shown: bool,
}

impl ProgressBar {
    /// A bar for `total` units of work. The units in `done` were done earlier and do not count for the remaining time.
    pub(crate) fn new(total: u64, done: u64) -> Self {
        let mut shown = SHOWN.lock().unwrap_or_else(PoisonError::into_inner);
        if shown.is_some() {
            return Self { bar: indicatif::ProgressBar::hidden(), is_shown: false };
        }
        let bar = indicatif::ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr_with_hz(5));
        let style = ProgressStyle::with_template("{bar:40} {percent:>3} %  {elapsed} elapsed, {eta} left  {msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        // The bar panics if the system starts no thread for it.
        if !bar.is_hidden() && thread::Builder::new().spawn(|| ()).is_ok() {
            bar.enable_steady_tick(Duration::from_millis(500));
        }
        bar.set_position(done);
        bar.reset_eta();
        *shown = Some(bar.clone());
        Self { bar, is_shown: true }
    }

    /// Shows the progress.
    pub(crate) fn show(&self, done: u64, total: u64) {
        self.bar.set_length(total);
        self.bar.set_position(done);
        if done >= total {
            self.bar.finish_and_clear();
        }
    }

    /// Shows the current task.
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
