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
//! Here one lane of a vector is one node, and all sides are computed together: [`pass_up`] runs the upward loop and
//! [`pass_down`] the downward one. An edge has one slot. It holds the message received until `pass_up` overwrites it.

use bp_core::{EdgeLevels, Smoothness};
use fearless_simd::{Level, Simd, SimdBase, dispatch, u8x16};

use crate::{
    compare::Vector,
    greys::{Around, of_levels},
};

/// The nodes of one plane in one row, with everything that their messages depend on.
pub(crate) struct Nodes<'a> {
    /// Data costs `[label][lane]`.
    pub(crate) costs: &'a [u8],
    /// The masks of the first two slots; see [`crate::layout::Layout::masks`].
    pub(crate) masks: [&'a [u8]; 2],
    /// Number of nodes.
    pub(crate) nodes: usize,
    /// Lanes from one label to the next.
    pub(crate) lanes: usize,
    /// The smoothness costs of edges.
    pub(crate) edges: &'a EdgeLevels,
    /// The grey values that determine the levels of edges; `None` if all have the same cost.
    pub(crate) around: Option<Around<'a>>,
}

impl Nodes<'_> {
    fn labels(&self) -> usize {
        self.costs.len() / self.lanes
    }

    /// A value of the smoothness cost for the edges of a vector of nodes, by slot. Without `LEVELS`, every edge has the same
    /// value.
    #[inline(always)]
    fn of_edges<S: Simd, V: Vector<S>, const LEVELS: bool>(
        &self,
        simd: S,
        at: usize,
        value: impl Fn(Smoothness) -> u8,
    ) -> [V; 4] {
        let by_level = self.edges.smoothness().map(value);
        let mut values = [V::splat(simd, by_level[0]); 4];
        if let Some(around) = self.around.filter(|_| LEVELS) {
            for (slot, out) in values.iter_mut().enumerate() {
                *out = of_levels(simd, around.levels(simd, slot, at), by_level);
            }
        }
        values
    }
}

/// Sends messages in place: each overwrites the message that came over the same edge.
pub(crate) fn update_messages(level: Level, nodes: &Nodes<'_>, slots: [&mut [u8]; 4]) {
    if nodes.around.is_some() {
        dispatch!(level, simd => row::<_, true>(simd, nodes, slots));
    } else {
        dispatch!(level, simd => row::<_, false>(simd, nodes, slots));
    }
}

/// Processes a row vector by vector. The last vector may reach beyond the last node into the padding, where it does not matter what
/// happens; it is narrow if a narrow one is enough.
#[inline(always)]
fn row<S: Simd, const LEVELS: bool>(simd: S, nodes: &Nodes<'_>, slots: [&mut [u8]; 4]) {
    let [same, next, up, down] = slots;
    // Slices of one known length let the compiler drop the bounds checks in the loops.
    let len = nodes.costs.len();
    let mut slots = [&mut same[..len], &mut next[..len], &mut up[..len], &mut down[..len]];
    for at in (0..nodes.nodes).step_by(S::u8s::LEN) {
        if nodes.nodes - at > u8x16::<S>::LEN {
            vector::<S, S::u8s, LEVELS>(simd, nodes, &mut slots, at);
        } else {
            vector::<S, u8x16<S>, LEVELS>(simd, nodes, &mut slots, at);
        }
    }
}

/// Sends the messages of a vector of nodes. A pass up the labels adds the received messages and starts the lower
/// envelope; a pass down finishes it (Felzenszwalb and Huttenlocher 2006). Between the two passes, the slots hold the
/// envelope.
#[inline(always)]
fn vector<S, V, const LEVELS: bool>(simd: S, nodes: &Nodes<'_>, slots: &mut [&mut [u8]; 4], at: usize)
where
    S: Simd,
    V: Vector<S>,
{
    let least = pass_up::<S, V, LEVELS>(simd, nodes, slots, at);
    pass_down::<S, V, LEVELS>(simd, nodes, slots, at, least);
}

/// Writes the upward envelopes to the slots and returns the least entry of each side's h.
#[inline(always)]
fn pass_up<S: Simd, V: Vector<S>, const LEVELS: bool>(
    simd: S,
    nodes: &Nodes<'_>,
    slots: &mut [&mut [u8]; 4],
    at: usize,
) -> [V; 4] {
    let step = nodes.of_edges::<S, V, LEVELS>(simd, at, Smoothness::step);
    let masks = nodes.masks.map(|mask| V::from_slice(simd, &mask[at..at + V::LEN]));
    let mut envelope = [V::splat(simd, u8::MAX); 4];
    let mut least = envelope;
    let mut start = at;
    while start + V::LEN <= nodes.costs.len() {
        let h = gather::<S, V>(simd, nodes, masks, slots, start);
        for side in 0..4 {
            envelope[side] = envelope[side].saturating_add(step[side]).min(h[side]);
            least[side] = least[side].min(envelope[side]);
        }
        for side in 0..4 {
            envelope[side].store_slice(&mut slots[side][start..start + V::LEN]);
        }
        start += nodes.lanes;
    }
    least
}

/// Turns the upward envelopes into messages.
#[inline(always)]
fn pass_down<S: Simd, V: Vector<S>, const LEVELS: bool>(
    simd: S,
    nodes: &Nodes<'_>,
    slots: &mut [&mut [u8]; 4],
    at: usize,
    least: [V; 4],
) {
    let step = nodes.of_edges::<S, V, LEVELS>(simd, at, Smoothness::step);
    let truncation = nodes.of_edges::<S, V, LEVELS>(simd, at, |smoothness| smoothness.truncation);
    let mut envelope = [V::splat(simd, u8::MAX); 4];
    let mut start = at + nodes.labels() * nodes.lanes;
    while start > at {
        start -= nodes.lanes;
        // All loads come before the stores: slots often lie a multiple of 4 KiB apart, and a load would have to wait
        // for a store at such a distance.
        for side in 0..4 {
            let half = V::from_slice(simd, &slots[side][start..start + V::LEN]);
            envelope[side] = envelope[side].saturating_add(step[side]).min(half);
        }
        for side in 0..4 {
            let message = (envelope[side] - least[side]).min(truncation[side]);
            message.store_slice(&mut slots[side][start..start + V::LEN]);
        }
    }
}

/// Computes h for each side: the data cost plus the messages received from the other three sides. The sum of two
/// messages is at most 2K, so only additions to the data cost can saturate.
#[inline(always)]
fn gather<S: Simd, V: Vector<S>>(
    simd: S,
    nodes: &Nodes<'_>,
    masks: [V; 2],
    slots: &[&mut [u8]; 4],
    start: usize,
) -> [V; 4] {
    let range = start..start + V::LEN;
    let load = |values: &[u8]| V::from_slice(simd, &values[range.clone()]);
    let cost = load(nodes.costs);
    let [same, next] = [load(slots[0]) & masks[0], load(slots[1]) & masks[1]];
    let [up, down] = [load(slots[2]), load(slots[3])];
    let sides = cost.saturating_add(same + next);
    let (vertical_up, vertical_down) = (sides.saturating_add(down), sides.saturating_add(up));
    let vertical = cost.saturating_add(up + down);
    [vertical.saturating_add(next), vertical.saturating_add(same), vertical_up, vertical_down]
}
