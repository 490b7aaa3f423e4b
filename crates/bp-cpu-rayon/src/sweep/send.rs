//! Message passing: the kernel that sends the messages of one block.
//!
//! It computes what `update_messages` of the half-steps does, in a layout where each walk over the labels is contiguous, and
//! for lists of labels: between two entries, the envelope rises by what the smoothness costs from one label to the other.

use bp_core::EdgeLevels;
use fearless_simd::{Simd, SimdBase, SimdInt};

use super::{
    edges::{levels, of_edges, of_sides},
    lists::List,
    padded::Padded,
};
use crate::{
    block::{Block, Bytes, LANES},
    greys::Around,
};

/// The nodes of a block, with everything that their messages depend on. Each slice is `[entry]`.
pub(crate) struct Nodes<'a> {
    pub(crate) plane: usize,
    pub(crate) list: List<'a>,
    pub(crate) costs: &'a [Block],
    pub(crate) edges: &'a EdgeLevels,
    /// The grey values that determine the levels of edges, from the block's first lane on. Slot 2 is the edge behind, slot
    /// 3 the one ahead.
    pub(crate) greys: Option<(Around<'a>, usize)>,
}

/// The edges of the nodes of a block. `behind` lies against the direction of the pass.
pub(crate) struct Slots<'a> {
    pub(crate) same: &'a mut [Block],
    pub(crate) next: &'a mut [Padded],
    pub(crate) behind: &'a [Block],
    pub(crate) ahead: &'a mut [Block],
}

impl Nodes<'_> {
    /// The levels of the edges to the sides and ahead.
    #[inline(always)]
    fn levels<S: Simd, const LEVELS: bool>(&self, simd: S) -> [Bytes<S>; 3] {
        let greys = self.greys.filter(|_| LEVELS);
        levels(simd, greys.map(|(around, _)| around), greys.map_or(0, |(_, lane)| lane), [0, 1, 3])
    }

    #[inline(always)]
    fn truncations<S: Simd, const LEVELS: bool>(&self, simd: S, levels: [Bytes<S>; 3]) -> [Bytes<S>; 3] {
        of_sides::<S, LEVELS>(simd, levels, self.edges.smoothness().map(|smoothness| smoothness.truncation))
    }
}

/// Sends to both sides and, if `AHEAD`, in the direction of the pass. Each message replaces what its edge held.
#[inline(always)]
pub(crate) fn to_sides<S: Simd, const LEVELS: bool, const AHEAD: bool>(simd: S, nodes: &Nodes<'_>, slots: Slots<'_>) {
    if nodes.plane == 0 {
        to_sides_of::<S, LEVELS, AHEAD, -1>(simd, nodes, slots);
    } else {
        to_sides_of::<S, LEVELS, AHEAD, 0>(simd, nodes, slots);
    }
}

#[inline(always)]
fn to_sides_of<S: Simd, const LEVELS: bool, const AHEAD: bool, const NEXT: isize>(
    simd: S,
    nodes: &Nodes<'_>,
    slots: Slots<'_>,
) {
    let len = nodes.list.labels.len();
    // Slices of one known length let the compiler drop the bounds checks in the loops.
    let costs = &nodes.costs[..len];
    // Steps to each label, from below and from above.
    let (upward, downward) = (&nodes.list.steps[..len], &nodes.list.steps[1..][..len]);
    let (same, next) = (&mut slots.same[..len], &mut slots.next[..len]);
    let (behind, ahead) = (&slots.behind[..len], &mut slots.ahead[..len]);
    let levels = nodes.levels::<S, LEVELS>(simd);
    let sent = if AHEAD { 3 } else { 2 };
    let mut envelope = [Bytes::<S>::splat(simd, u8::MAX); 3];
    let mut least = envelope;
    for entry in 0..len {
        let cost = costs[entry].load(simd);
        let (from_same, from_next) = (same[entry].load(simd), next[entry].load::<S, NEXT>(simd));
        let (from_behind, from_ahead) = (behind[entry].load(simd), ahead[entry].load(simd));
        // The sum of two messages is at most 2K, so only additions to the data cost can saturate.
        let vertical = cost.saturating_add(from_behind + from_ahead);
        let onward = cost.saturating_add(from_same + from_next).saturating_add(from_behind);
        let h = [vertical.saturating_add(from_next), vertical.saturating_add(from_same), onward];
        for side in 0..sent {
            let step = of_edges::<S, LEVELS>(simd, levels[side], upward[entry]);
            envelope[side] = envelope[side].saturating_add(step).min(h[side]);
            least[side] = least[side].min(envelope[side]);
        }
        same[entry].store(envelope[0]);
        next[entry].store::<S, NEXT>(envelope[1]);
        if AHEAD {
            ahead[entry].store(envelope[2]);
        }
    }
    let truncation = nodes.truncations::<S, LEVELS>(simd, levels);
    envelope = [Bytes::splat(simd, u8::MAX); 3];
    for entry in (0..len).rev() {
        let mut half = [same[entry].load(simd), next[entry].load::<S, NEXT>(simd), envelope[2]];
        if AHEAD {
            half[2] = ahead[entry].load(simd);
        }
        for side in 0..sent {
            let step = of_edges::<S, LEVELS>(simd, levels[side], downward[entry]);
            envelope[side] = envelope[side].saturating_add(step).min(half[side]);
        }
        same[entry].store((envelope[0] - least[0]).min(truncation[0]));
        next[entry].store::<S, NEXT>((envelope[1] - least[1]).min(truncation[1]));
        if AHEAD {
            ahead[entry].store((envelope[2] - least[2]).min(truncation[2]));
        }
    }
}

/// Sends only in the direction of the pass.
#[inline(always)]
pub(crate) fn ahead<S: Simd, const LEVELS: bool>(simd: S, nodes: &Nodes<'_>, slots: Slots<'_>) {
    if nodes.plane == 0 {
        ahead_of::<S, LEVELS, -1>(simd, nodes, slots);
    } else {
        ahead_of::<S, LEVELS, 0>(simd, nodes, slots);
    }
}

#[inline(always)]
fn ahead_of<S: Simd, const LEVELS: bool, const NEXT: isize>(simd: S, nodes: &Nodes<'_>, slots: Slots<'_>) {
    let len = nodes.list.labels.len();
    let costs = &nodes.costs[..len];
    // Steps to each label, from below and from above.
    let (upward, downward) = (&nodes.list.steps[..len], &nodes.list.steps[1..][..len]);
    let (same, next) = (&slots.same[..len], &slots.next[..len]);
    let (behind, ahead) = (&slots.behind[..len], &mut slots.ahead[..len]);
    let levels = nodes.levels::<S, LEVELS>(simd);
    let mut envelope = Envelope::new(simd);
    let mut least = Bytes::<S>::splat(simd, u8::MAX);
    for entry in 0..len {
        let sides = same[entry].load(simd) + next[entry].load::<S, NEXT>(simd);
        let h = costs[entry].load(simd).saturating_add(sides).saturating_add(behind[entry].load(simd));
        let reached = envelope.rise(of_edges::<S, LEVELS>(simd, levels[2], upward[entry]), h);
        least = least.min(reached);
        ahead[entry].store(reached);
    }
    let truncation = nodes.truncations::<S, LEVELS>(simd, levels);
    envelope = Envelope::new(simd);
    for entry in (0..len).rev() {
        let step = of_edges::<S, LEVELS>(simd, levels[2], downward[entry]);
        let reached = envelope.rise(step, ahead[entry].load(simd));
        ahead[entry].store((reached - least).min(truncation[2]));
    }
}

/// The lower envelope of values, each some step after the one before: `min(envelope + step, value)`.
///
/// A single envelope is a chain of operations that takes longer than everything else in its loop. So each call starts from the
/// envelope of the call before the last, and two chains run at the same time.
struct Envelope<S: Simd> {
    /// The last two, the older one first.
    reached: [Bytes<S>; 2],
    step: Bytes<S>,
    value: Bytes<S>,
}

impl<S: Simd> Envelope<S> {
    #[inline(always)]
    fn new(simd: S) -> Self {
        let none = Bytes::splat(simd, u8::MAX);
        Self { reached: [none; 2], step: none, value: none }
    }

    /// The envelope at the next value.
    #[inline(always)]
    fn rise(&mut self, step: Bytes<S>, value: Bytes<S>) -> Bytes<S> {
        let from_values = self.value.saturating_add(step).min(value);
        let from_envelope = self.reached[0].saturating_add(self.step.saturating_add(step));
        self.reached = [self.reached[1], from_envelope.min(from_values)];
        (self.step, self.value) = (step, value);
        self.reached[1]
    }
}

const _: () = assert!(LANES == 32, "a block is one vector of 32 bytes");
