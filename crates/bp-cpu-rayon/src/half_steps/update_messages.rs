//! Message passing: the kernel that sends the messages of one plane of nodes in one row.
//!
//! In the terms of `bp-cpu-scalar`, it computes for every node:
//!
//! ```text
//! for each side `to` that the node sends to:
//!     for each label d:   h(d) = cost(d) + messages received from the other three sides (d)
//!     least = min over d of h(d)
//!     envelope = 255
//!     for d upwards:      envelope = min(envelope + step, h(d));  h(d) = envelope
//!     for d downwards:    envelope = min(envelope + step, h(d));  h(d) = min(envelope - least, truncation)
//!     the message is h
//! ```
//!
//! Here one lane of a vector is one node, and all sides are computed together: `pass_up` runs the upward loop and
//! `pass_down` the downward one. An edge has one slot. It holds the message received until `pass_up` overwrites it.

use bp_core::{EdgeLevels, Smoothness};
use fearless_simd::{Level, Simd, SimdBase, SimdInt, dispatch};

use super::edges::Slots;
use crate::{
    block::{Block, Bytes, LANES},
    greys::{Around, of_levels},
    shape::Shape,
};

/// The nodes of one plane in one row, with everything that their messages depend on.
pub(crate) struct Nodes<'a> {
    /// Data costs `[block][label]`.
    pub(crate) costs: &'a [Block],
    /// The masks of the first two slots; see [`crate::layout::Layout::masks`].
    pub(crate) masks: [&'a [u8]; 2],
    pub(crate) shape: &'a Shape,
    /// The smoothness costs of edges.
    pub(crate) edges: &'a EdgeLevels,
    /// The grey values that determine the levels of edges; `None` if all have the same cost.
    pub(crate) around: Option<Around<'a>>,
}

/// Sends messages in place: each overwrites the message that came over the same edge.
pub(crate) fn update_messages(level: Level, nodes: &Nodes<'_>, slots: Slots<'_>) {
    match (nodes.around.is_some(), slots.moving.is_some()) {
        (false, false) => dispatch!(level, simd => nodes.send::<_, false, false>(simd, slots)),
        (false, true) => dispatch!(level, simd => nodes.send::<_, false, true>(simd, slots)),
        (true, false) => dispatch!(level, simd => nodes.send::<_, true, false>(simd, slots)),
        (true, true) => dispatch!(level, simd => nodes.send::<_, true, true>(simd, slots)),
    }
}

/// The data costs of a block of nodes and its edges, for every label.
struct OfBlock<'a> {
    costs: &'a [Block],
    slots: [&'a mut [Block]; 4],
    /// If values of the second slot are moved, that slot in the next block.
    after: &'a [Block],
    /// And what the block before this one sent there: the first lane of the slot belongs to the last node of that block, so it is
    /// written one block late.
    before: &'a mut [Block],
    /// See [`Nodes::masks`].
    masks: [&'a [u8]; 2],
}

impl Nodes<'_> {
    /// Sends the messages of the plane, block by block.
    #[inline(always)]
    fn send<S: Simd, const LEVELS: bool, const MOVED: bool>(&self, simd: S, slots: Slots<'_>) {
        let (labels, [same, next, up, down]) = (self.shape.labels, slots.values);
        let room = slots.moving.unwrap_or_default();
        for block in 0..self.shape.blocks {
            let range = self.shape.block(block);
            let (own, after) = next[range.start..].split_at_mut(labels);
            let masks = self.masks.map(|mask| &mask[LANES * block..LANES * (block + 1)]);
            let mut of_block = OfBlock {
                costs: &self.costs[range.clone()],
                slots: [&mut same[range.clone()], own, &mut up[range.clone()], &mut down[range]],
                // Behind the last block are no nodes, so any values will do.
                after: after.get(..labels).unwrap_or_default(),
                before: &mut *room,
                masks,
            };
            let step = self.of_edges::<S, LEVELS>(simd, block, Smoothness::step);
            let least = of_block.pass_up::<S, MOVED>(simd, step);
            let truncation = self.of_edges::<S, LEVELS>(simd, block, |smoothness| smoothness.truncation);
            of_block.pass_down::<S, MOVED>(simd, step, least, truncation);
        }
    }

    /// A value of the smoothness cost for the edges of a block of nodes, by slot. Without `LEVELS`, every edge has the same
    /// value.
    #[inline(always)]
    fn of_edges<S: Simd, const LEVELS: bool>(
        &self,
        simd: S,
        block: usize,
        value: impl Fn(Smoothness) -> u8,
    ) -> [Bytes<S>; 4] {
        let by_level = self.edges.smoothness().map(value);
        let mut values = [Bytes::splat(simd, by_level[0]); 4];
        if let Some(around) = self.around.filter(|_| LEVELS) {
            for (slot, out) in values.iter_mut().enumerate() {
                *out = of_levels(simd, around.levels(simd, slot, LANES * block), by_level);
            }
        }
        values
    }
}

/// The messages of a block of nodes (Felzenszwalb and Huttenlocher 2006). A pass up the labels adds the received messages and
/// starts the lower envelope; a pass down finishes it. Between the two passes, the slots hold the envelope.
impl OfBlock<'_> {
    /// Writes the upward envelopes to the slots and returns the least entry of each side's h.
    #[inline(always)]
    fn pass_up<S: Simd, const MOVED: bool>(&mut self, simd: S, step: [Bytes<S>; 4]) -> [Bytes<S>; 4] {
        let Self { costs, slots: [same, next, up, down], after, masks, .. } = self;
        let masks = masks.map(|mask| Bytes::from_slice(simd, mask));
        let mut envelope = [Bytes::splat(simd, u8::MAX); 4];
        let mut least = envelope;
        let slots = same.iter_mut().zip(next.iter_mut()).zip(up.iter_mut().zip(down.iter_mut()));
        for (label, (cost, ((same, next), (up, down)))) in costs.iter().zip(slots).enumerate() {
            let mut received = [&*same, &*next, &*up, &*down].map(
                #[inline(always)]
                |block| block.load(simd),
            );
            if MOVED {
                let after = after.get(label).unwrap_or(&Block::ZERO).load(simd);
                received[1] = received[1].slide::<1>(after);
            }
            let [of_same, of_next, of_up, of_down] = received;
            let h = gather(cost.load(simd), [of_same & masks[0], of_next & masks[1], of_up, of_down]);
            for side in 0..4 {
                envelope[side] = envelope[side].saturating_add(step[side]).min(h[side]);
                least[side] = least[side].min(envelope[side]);
            }
            same.store(envelope[0]);
            next.store(envelope[1]);
            up.store(envelope[2]);
            down.store(envelope[3]);
        }
        least
    }

    /// Turns the upward envelopes into messages.
    #[inline(always)]
    fn pass_down<S: Simd, const MOVED: bool>(
        &mut self,
        simd: S,
        step: [Bytes<S>; 4],
        least: [Bytes<S>; 4],
        truncation: [Bytes<S>; 4],
    ) {
        let Self { slots: [same, next, up, down], before, .. } = self;
        let mut envelope = [Bytes::splat(simd, u8::MAX); 4];
        let slots = same.iter_mut().zip(next.iter_mut()).zip(up.iter_mut().zip(down.iter_mut()));
        for (label, ((same, next), (up, down))) in slots.enumerate().rev() {
            let mut message = [&*same, &*next, &*up, &*down].map(
                #[inline(always)]
                |block| block.load(simd),
            );
            for side in 0..4 {
                envelope[side] = envelope[side].saturating_add(step[side]).min(message[side]);
                message[side] = (envelope[side] - least[side]).min(truncation[side]);
            }
            if let Some(before) = before.get_mut(label).filter(|_| MOVED) {
                let sent = message[1];
                message[1] = before.load(simd).slide::<{ LANES - 1 }>(sent);
                before.store(sent);
            }
            same.store(message[0]);
            next.store(message[1]);
            up.store(message[2]);
            down.store(message[3]);
        }
    }
}

/// Computes h for each side: the data cost plus the messages received from the other three sides. The sum of two
/// messages is at most 2K, so only additions to the data cost can saturate.
#[inline(always)]
fn gather<S: Simd>(cost: Bytes<S>, [same, next, up, down]: [Bytes<S>; 4]) -> [Bytes<S>; 4] {
    let sides = cost.saturating_add(same + next);
    let (vertical_up, vertical_down) = (sides.saturating_add(down), sides.saturating_add(up));
    let vertical = cost.saturating_add(up + down);
    [vertical.saturating_add(next), vertical.saturating_add(same), vertical_up, vertical_down]
}
