//! Ctrl-C and progress: a run is stopped between two steps (all loops of a grid that is swept are one), so that nothing
//! is left half done.

use std::{
    ops::ControlFlow,
    sync::atomic::{AtomicBool, Ordering},
    time::Duration,
};

use indicatif::{ProgressDrawTarget, ProgressStyle};

use crate::{failure::Failure, tell};

static STOPPED: AtomicBool = AtomicBool::new(false);

/// Makes Ctrl-C and SIGTERM stop the program at the next step, and a second one at once. For commands that take steps;
/// others are stopped by the system.
pub(crate) fn listen() -> Result<(), Failure> {
    let stop = || {
        if STOPPED.swap(true, Ordering::Relaxed) {
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
    if STOPPED.load(Ordering::Relaxed) { Err(Failure::interrupted()) } else { Ok(()) }
}

/// A bar on standard error, with the time left; not drawn where that is no terminal.
pub(crate) struct ProgressBar(indicatif::ProgressBar);

impl ProgressBar {
    /// A bar for so many message entries.
    pub(crate) fn new(total: u64) -> Self {
        let bar = indicatif::ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr_with_hz(5));
        let style = ProgressStyle::with_template("{bar:40} {percent:>3} %  {elapsed} elapsed, {eta} left  {msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        bar.enable_steady_tick(Duration::from_millis(500));
        Self(bar)
    }

    /// Shows how much is done; breaks where the user has asked to stop.
    pub(crate) fn update(&self, done: u64) -> ControlFlow<()> {
        self.0.set_position(done);
        if STOPPED.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    /// Starts from a run that was interrupted after so many entries: they say nothing about the time left.
    pub(crate) fn resume_at(&self, done: u64) {
        self.0.set_position(done);
        self.0.reset_eta();
    }

    /// Corrects how many entries there are.
    pub(crate) fn set_total(&self, total: u64) {
        self.0.set_length(total);
    }

    /// Shows what is being done.
    pub(crate) fn message(&self, message: String) {
        self.0.set_message(message);
    }

    /// Prints a line above the bar.
    pub(crate) fn line(&self, line: &str) {
        self.0.suspend(|| tell(line));
    }

    /// Removes the bar.
    pub(crate) fn finish(&self) {
        self.0.finish_and_clear();
    }
}
