//! Lets a caller follow and stop long work.

use std::{
    fmt,
    ops::ControlFlow,
    panic::resume_unwind,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
        mpsc::{Receiver, RecvTimeoutError, Sender, channel, sync_channel},
    },
    thread,
    time::Duration,
};

/// How soon a stop is noticed while work waits for others.
const PATIENCE: Duration = Duration::from_millis(50);

/// A request to stop work at its next step. All clones share it.
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Requests a stop. Returns whether one was requested before.
    pub fn stop(&self) -> bool {
        self.0.swap(true, Ordering::Relaxed)
    }

    /// Whether a stop was requested.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// The error of work that ended before its result because of its [`Stop`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("interrupted")]
pub struct Stopped;

/// Something that happens during the work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Event<'a> {
    /// Progress. The unit depends on the call: message entries or pairs.
    Progress {
        /// Units done.
        done: u64,
        /// Units in all; may change during the work.
        total: u64,
    },
    /// The task that begins now, in a few words.
    Task(&'a str),
    /// An intermediate result, as a line of text.
    Line(&'a str),
    /// A sentence with useful information.
    Note(&'a str),
    /// A sentence about a possible problem.
    Warning(&'a str),
    /// A sentence about a part of the work that failed; the rest continues.
    Failed(&'a str),
}

/// How a caller follows and stops work: it receives the events, and the work obeys its [`Stop`].
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

    /// The same stop with another receiver of events.
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

    /// Sends the progress. Breaks if the work should stop.
    pub fn progress(&self, done: u64, total: u64) -> ControlFlow<()> {
        self.tell(Event::Progress { done, total });
        if self.is_stopped() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    /// Whether the work should stop.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.stop.is_some_and(Stop::is_stopped)
    }

    /// Does work that may wait for others, such as reading or writing a pipe, on a thread of its own. If it should stop meanwhile, that
    /// thread is left behind. If the system starts none, the work cannot be stopped.
    ///
    /// # Errors
    /// [`Stopped`].
    ///
    /// # Panics
    /// If the work does.
    pub fn unless_stopped<T: Send + 'static, Work: FnOnce() -> T + Send + 'static>(
        &self,
        work: Work,
    ) -> Result<T, Stopped> {
        let Some(stop) = self.stop else { return Ok(work()) };
        let (done, outcome) = sync_channel(1);
        // The work follows once there is a thread; else it is done on this one.
        let (give, given) = sync_channel(1);
        let begin = move || drop(given.recv().map(|work: Work| done.send(work())));
        let Ok(worker) = thread::Builder::new().spawn(begin) else { return Ok(work()) };
        drop(give.send(work));
        loop {
            match outcome.recv_timeout(PATIENCE) {
                Ok(value) => return Ok(value),
                Err(RecvTimeoutError::Timeout) if stop.is_stopped() => return Err(Stopped),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => {
                    return worker.join().map_or_else(|panic| resume_unwind(panic), |()| Err(Stopped));
                }
            }
        }
    }

    /// Fails if the work should stop.
    ///
    /// # Errors
    /// [`Stopped`].
    pub fn check(&self) -> Result<(), Stopped> {
        if self.is_stopped() { Err(Stopped) } else { Ok(()) }
    }
}

/// The end of work on other threads; see [`crate::Matcher::compute_attended`].
#[derive(Debug)]
pub struct Ending(Receiver<()>);

/// What the work drops when it ends, and what waits for that.
pub(crate) fn ending() -> (Sender<()>, Ending) {
    let (running, end) = channel();
    (running, Ending(end))
}

impl Ending {
    /// Waits for the end, but not longer than `patience`. Returns whether the work has ended.
    pub fn wait(&mut self, patience: Duration) -> bool {
        self.0.recv_timeout(patience) == Err(RecvTimeoutError::Disconnected)
    }
}

/// Ignores all events and never stops.
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
