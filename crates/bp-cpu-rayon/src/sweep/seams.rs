//! What was prepared for each seam of a swept grid; see [`bp_core::Seam`].

use std::sync::RwLock;

use bp_core::{Error, Plan, Schedule, Seam, memory};

use super::lists::{self, Lists, sources};
use crate::block::Block;

/// One seam. Every grid overwrites what was prepared for the coarser one.
#[derive(Default)]
pub(crate) struct Prepared {
    /// The labels that the messages have values for.
    pub(crate) lists: Lists,
    /// The messages across it from above, then those from below, both `[plane][entry]`.
    pub(crate) messages: [Vec<Block>; 2],
    /// The labels of [`Seam::label_rows`].
    pub(crate) labels: Vec<u16>,
    /// The grid that it was prepared for, in this solve.
    pub(crate) grid: Option<usize>,
}

/// A seam that several bands may read. The first of them prepares it.
pub(crate) type Seams = RwLock<Prepared>;

/// The number of seams.
fn count(plan: &Plan) -> usize {
    if plan.settings().schedule == Schedule::Sweep { Seam::all(plan.image_size().height).len() } else { 0 }
}

/// The bytes that [`prepared`] seams hold, whatever their lists.
pub(crate) fn bytes(plan: &Plan, patches: usize, entries: usize) -> u64 {
    let labels = (Seam::LABEL_ROWS * plan.image_size().width * size_of::<u16>()) as u64;
    let messages = (entries as u64).saturating_mul(4 * size_of::<Block>() as u64);
    (count(plan) as u64).saturating_mul(labels + messages + lists::bytes(patches, entries))
}

/// Makes room for the seams of the finest grid.
pub(crate) fn prepared(plan: &Plan) -> Result<Vec<Seams>, Error> {
    let len = Seam::LABEL_ROWS * plan.image_size().width;
    let seam = |_| Ok(RwLock::new(Prepared { labels: memory::filled("labels", len, 0)?, ..Prepared::default() }));
    (0..count(plan)).map(seam).collect()
}

impl Prepared {
    /// Makes room for so many patches and entries.
    pub(crate) fn fit(&mut self, patches: usize, entries: usize) -> Result<(), Error> {
        self.lists.fit(patches, entries)?;
        self.fit_messages(entries)
    }

    /// Makes room for messages with so many entries.
    pub(crate) fn fit_messages(&mut self, entries: usize) -> Result<(), Error> {
        self.messages.iter_mut().try_for_each(|messages| memory::grow("messages", messages, 2 * entries, Block::ZERO))
    }

    /// The labels of the row above it.
    pub(crate) fn labels_above(&self, width: usize) -> &[u16] {
        &self.labels[(Seam::LABEL_ROWS - 1) * width..Seam::LABEL_ROWS * width]
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
        let messages: u64 = self.messages.iter().map(memory::bytes).sum();
        self.lists.bytes() + messages + memory::bytes(&self.labels)
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
