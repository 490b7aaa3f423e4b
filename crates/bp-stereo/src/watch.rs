//! How a caller follows work that takes a while, and stops it.

use std::{
    fmt,
    ops::ControlFlow,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

/// Asks work to stop at its next step. Clones ask together.
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Asks to stop; returns whether somebody had asked before.
    pub fn stop(&self) -> bool {
        self.0.swap(true, Ordering::Relaxed)
    }

    /// Whether somebody has asked.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Work ended before its result because its [`Stop`] asked for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("interrupted")]
pub struct Stopped;

/// Something that happens while work goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Event<'a> {
    /// How far the work has come. The unit differs between calls: message entries, or pairs.
    Progress {
        /// Units done.
        done: u64,
        /// Units in all; may change while the work goes on.
        total: u64,
    },
    /// What is being worked on from now on, in a few words.
    Task(&'a str),
    /// A result on the way, as a line of text.
    Line(&'a str),
    /// A sentence that is good to know.
    Note(&'a str),
    /// A sentence about something that may be wrong.
    Warning(&'a str),
    /// A part of the work failed, as this sentence says; the rest goes on.
    Failed(&'a str),
}

/// A caller's ear and hand: events go to it, and its [`Stop`] is obeyed.
#[derive(Clone, Copy)]
pub struct Watch<'a> {
    events: &'a (dyn Fn(Event<'_>) + Sync),
    stop: Option<&'a Stop>,
}

impl<'a> Watch<'a> {
    /// Sends events to `events`, which may be called from any thread, and obeys `stop`.
    #[must_use]
    pub fn new(events: &'a (dyn Fn(Event<'_>) + Sync), stop: &'a Stop) -> Self {
        Self { events, stop: Some(stop) }
    }

    /// The same stop with other ears.
    #[must_use]
    pub fn with_events<'b>(&'b self, events: &'b (dyn Fn(Event<'_>) + Sync)) -> Watch<'b> {
        Watch { events, stop: self.stop }
    }

    /// Sends an event.
    pub fn tell(&self, event: Event<'_>) {
        (self.events)(event);
    }

    /// Sends a note.
    pub fn note(&self, text: &str) {
        self.tell(Event::Note(text));
    }

    /// Sends a warning.
    pub fn warn(&self, text: &str) {
        self.tell(Event::Warning(text));
    }

    /// Sends how far the work has come; breaks where it should stop.
    pub fn progress(&self, done: u64, total: u64) -> ControlFlow<()> {
        self.tell(Event::Progress { done, total });
        if self.is_stopped() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    /// Whether the work should stop.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.stop.is_some_and(Stop::is_stopped)
    }

    /// Fails where the work should stop.
    ///
    /// # Errors
    /// [`Stopped`].
    pub fn check(&self) -> Result<(), Stopped> {
        if self.is_stopped() { Err(Stopped) } else { Ok(()) }
    }
}

/// Nobody listens, and nobody stops the work.
impl Default for Watch<'_> {
    fn default() -> Self {
        Self { events: &|_| (), stop: None }
    }
}

impl fmt::Debug for Watch<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.debug_struct("Watch").field("stop", &self.stop).finish_non_exhaustive()
    }
}
