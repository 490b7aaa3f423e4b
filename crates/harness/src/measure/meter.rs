//! The progress of a measurement.

use std::ops::ControlFlow;

use bp_stereo::{Event, Watch};

use crate::failure::Failure;

/// Reports progress in message entries, over one loop or several.
pub struct Meter<'a> {
    watch: Watch<'a>,
    /// Entries of finished turns.
    done: u64,
    /// Remaining entries of this loop.
    left: u64,
    /// Entries of later loops.
    pub ahead: u64,
}

impl<'a> Meter<'a> {
    /// A meter at zero.
    pub fn new(watch: &Watch<'a>) -> Self {
        Self { watch: *watch, done: 0, left: 0, ahead: 0 }
    }

    /// Reports `entries` of this turn as done; breaks if the work should stop.
    pub fn observe(&self, entries: u64) -> ControlFlow<()> {
        self.watch.progress(self.done + entries, self.done + self.left + self.ahead)
    }

    /// Adds the entries of finished turns.
    pub(super) fn add(&mut self, entries: u64) {
        self.done += entries;
    }

    /// Begins a turn with `left` entries remaining in this loop; fails if the work should stop.
    pub(super) fn begin(&mut self, task: &str, left: u64) -> Result<(), Failure> {
        self.left = left;
        self.watch.check()?;
        self.watch.tell(Event::Task(task));
        let _ = self.observe(0);
        Ok(())
    }

    /// Sends a line.
    pub fn line(&self, line: &str) {
        self.watch.tell(Event::Line(line));
    }
}
