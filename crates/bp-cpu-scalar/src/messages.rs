//! The messages of one grid, and room for the next loop's.

use bp_core::{Error, Plan, Schedule, Side, memory};

/// Adds a message to one node's sums, a value a label.
pub(crate) fn add(message: &[u8], sums: &mut [u8]) {
    sums.iter_mut().zip(message).for_each(|(sum, &message)| *sum = sum.saturating_add(message));
}

/// What every node last received from each side: `[side][node][label]`, sides in the order of [`Side::ALL`]. The slots
/// of neighbours that are not there stay 0, and so do those of messages used up under the schedule `sweep`.
pub(crate) struct Messages {
    labels: usize,
    received: [Vec<u8>; 4],
    /// Where a synchronous loop writes, so that it reads the loop before only; empty under other schedules.
    next: [Vec<u8>; 4],
}

impl Messages {
    /// Room for `grid` and for every second grid above it.
    pub(crate) fn new(plan: &Plan, grid: usize) -> Result<Self, Error> {
        let volume = || memory::filled("messages", plan.volume(grid), 0);
        let sync = plan.settings().schedule == Schedule::Sync;
        let next = || if sync { volume() } else { Ok(Vec::new()) };
        Ok(Self {
            labels: plan.model().labels(),
            received: [volume()?, volume()?, volume()?, volume()?],
            next: [next()?, next()?, next()?, next()?],
        })
    }

    /// Sets all messages of a grid of so many nodes to 0.
    pub(crate) fn clear(&mut self, nodes: usize) {
        let len = nodes * self.labels;
        self.received.iter_mut().chain(&mut self.next).for_each(|volume| {
            volume.iter_mut().take(len).for_each(|message| *message = 0);
        });
    }

    /// What `node` received from `side`, a value a label.
    pub(crate) fn received(&self, node: usize, side: Side) -> &[u8] {
        &self.received[side as usize][node * self.labels..][..self.labels]
    }

    /// What all nodes received from `side`, `[node][label]`.
    pub(crate) fn all_received(&self, side: Side) -> &[u8] {
        &self.received[side as usize]
    }

    /// The slot of what `node` receives from `side`.
    pub(crate) fn received_mut(&mut self, node: usize, side: Side) -> &mut [u8] {
        &mut self.received[side as usize][node * self.labels..][..self.labels]
    }

    /// The slot of what `node` will receive from `side` in the next loop.
    pub(crate) fn next_mut(&mut self, node: usize, side: Side) -> &mut [u8] {
        &mut self.next[side as usize][node * self.labels..][..self.labels]
    }

    /// Makes the next loop's messages the current ones.
    pub(crate) fn swap(&mut self) {
        std::mem::swap(&mut self.received, &mut self.next);
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        self.received.iter().chain(&self.next).map(memory::bytes).sum()
    }
}
