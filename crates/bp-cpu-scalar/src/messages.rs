//! The messages of one grid, and room for those of the next loop.

use std::ops::Range;

use bp_core::{Error, IsStopped, Plan, Schedule, Side, memory};

/// Adds a message to the sums of one node, label by label.
#[inline(always)]
pub(crate) fn add(message: &[u8], sums: &mut [u8]) {
    sums.iter_mut().zip(message).for_each(|(sum, &message)| *sum = sum.saturating_add(message));
}

/// The last message that every node received from each side: `[side][node][label]`, sides in the order of [`Side::ALL`].
/// The slots of missing neighbours are always 0, and so are those of messages that the schedule `sweep` has consumed.
pub(crate) struct Messages {
    labels: usize,
    received: [Vec<u8>; 4],
    /// The output of a synchronous loop, which must read only the previous loop. Empty under other schedules.
    next: [Vec<u8>; 4],
}

impl Messages {
    /// Allocates room for the messages of `grid`, which is also enough for every second coarser grid.
    pub(crate) fn new(plan: &Plan, grid: usize, is_stopped: IsStopped<'_>) -> Result<Self, Error> {
        let volume = || memory::filled_unless(is_stopped, "messages", plan.volume(grid), 0);
        let sync = plan.settings().schedule == Schedule::Sync;
        let next = || if sync { volume() } else { Ok(Vec::new()) };
        Ok(Self {
            labels: plan.model().labels(),
            received: [volume()?, volume()?, volume()?, volume()?],
            next: [next()?, next()?, next()?, next()?],
        })
    }

    /// Sets all messages of these nodes to 0.
    pub(crate) fn clear(&mut self, nodes: Range<usize>) {
        let values = nodes.start * self.labels..nodes.end * self.labels;
        let volumes = self.received.iter_mut().chain(&mut self.next).filter(|volume| !volume.is_empty());
        volumes.for_each(|volume| volume[values.clone()].fill(0));
    }

    /// The message that `node` received from `side`, one value for each label.
    pub(crate) fn received(&self, node: usize, side: Side) -> &[u8] {
        &self.received[side as usize][node * self.labels..][..self.labels]
    }

    /// The messages that all nodes received from `side`, `[node][label]`.
    pub(crate) fn all_received(&self, side: Side) -> &[u8] {
        &self.received[side as usize]
    }

    /// The bytes of the messages that a row of nodes received from one side.
    pub(crate) fn row_bytes(&self, width: usize) -> usize {
        width * self.labels
    }

    /// The messages that row y received from `side`, `[x][label]`.
    pub(crate) fn received_row(&self, width: usize, y: usize, side: Side) -> &[u8] {
        let row = self.row_bytes(width);
        &self.received[side as usize][y * row..][..row]
    }

    /// The same, to be written.
    pub(crate) fn received_row_mut(&mut self, width: usize, y: usize, side: Side) -> &mut [u8] {
        let row = self.row_bytes(width);
        &mut self.received[side as usize][y * row..][..row]
    }

    /// Sets all messages from `side` to 0.
    pub(crate) fn clear_side(&mut self, side: Side) {
        self.received[side as usize].fill(0);
    }

    /// The slot of the message that `node` receives from `side`.
    pub(crate) fn received_mut(&mut self, node: usize, side: Side) -> &mut [u8] {
        &mut self.received[side as usize][node * self.labels..][..self.labels]
    }

    /// The slot of the message that `node` receives from `side` in the next loop.
    pub(crate) fn next_mut(&mut self, node: usize, side: Side) -> &mut [u8] {
        &mut self.next[side as usize][node * self.labels..][..self.labels]
    }

    /// Makes the next loop's messages the current ones.
    pub(crate) fn swap(&mut self) {
        std::mem::swap(&mut self.received, &mut self.next);
    }

    /// The bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        self.received.iter().chain(&self.next).map(memory::bytes).sum()
    }
}
