//! What was prepared for each seam of a swept grid; see [`bp_core::Seam`].

use bp_core::{Error, Plan, Seam, memory::Buffer};

use super::lists::{self, Lists, sources};
use crate::block::Block;

/// One seam.
#[derive(Default)]
pub(crate) struct Prepared {
    /// The labels that the messages have values for.
    pub(crate) lists: Lists,
    /// The messages across it from above, then those from below, both `[plane][entry]`.
    pub(crate) messages: [Buffer<Block>; 2],
    /// The labels of [`Seam::label_rows`], if the grid decides any.
    pub(crate) labels: Buffer<u16>,
}

/// The number of labels of a seam.
fn labels(plan: &Plan, grid: usize) -> usize {
    if plan.decides_labels(grid) { Seam::LABEL_ROWS * plan.size(grid).width } else { 0 }
}

/// The bytes of a seam of a grid with so many patches and entries.
pub(crate) fn bytes(plan: &Plan, grid: usize, patches: usize, entries: usize) -> u64 {
    let labels = (labels(plan, grid) * size_of::<u16>()) as u64;
    let messages = (entries as u64).saturating_mul(4 * size_of::<Block>() as u64);
    labels.saturating_add(messages).saturating_add(lists::bytes(patches, entries))
}

impl Prepared {
    /// Makes room for the labels of a seam, which does not depend on its lists.
    pub(crate) fn new(plan: &Plan, grid: usize) -> Result<Self, Error> {
        Ok(Self { labels: Buffer::filled("labels", labels(plan, grid), 0)?, ..Self::default() })
    }

    /// Makes room for so many patches and entries.
    pub(crate) fn fit(&mut self, patches: usize, entries: usize) -> Result<(), Error> {
        self.lists.fit(patches, entries)?;
        self.fit_messages(entries)
    }

    /// Makes room for messages with so many entries.
    pub(crate) fn fit_messages(&mut self, entries: usize) -> Result<(), Error> {
        self.messages.iter_mut().try_for_each(|messages| messages.grow("messages", 2 * entries, Block::ZERO))
    }

    /// The labels of the row above it, if any are decided.
    pub(crate) fn labels_above(&self, width: usize) -> &[u16] {
        self.labels.rchunks(width).next().unwrap_or_default()
    }

    /// Writes its messages from above (0) or below (1) for the lists of a band, `[plane][entry]`.
    pub(crate) fn carry(&self, plan: &Plan, from: usize, lists: &Lists, out: &mut [Block]) {
        for patch in 0..lists.patches() {
            let own = self.lists.range(patch);
            let messages = [0, 1].map(|plane| &self.messages[from][plane * self.lists.entries()..][own.clone()]);
            let edges = plan.model().edges();
            let sources = sources(self.lists.list(patch).labels, lists.list(patch).labels, edges);
            for (entry, source) in lists.range(patch).zip(sources) {
                for (plane, messages) in messages.into_iter().enumerate() {
                    out[plane * lists.entries() + entry] = match source.exact() {
                        Some(entry) => messages[entry],
                        None => between(source.nearest(0), plan, messages),
                    };
                }
            }
        }
    }

    /// The bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        let messages: u64 = self.messages.iter().map(Buffer::bytes).sum();
        self.lists.bytes() + messages + self.labels.bytes()
    }
}

/// The values of messages for a label that they lack.
fn between([below, above]: [(usize, u8); 2], plan: &Plan, messages: &[Block]) -> Block {
    let mut values = Block::ZERO;
    let both = messages[below.0].0.iter().zip(&messages[above.0].0);
    for (value, (low, high)) in values.0.iter_mut().zip(both) {
        *value = low.saturating_add(below.1).min(high.saturating_add(above.1)).min(plan.model().truncation());
    }
    values
}
