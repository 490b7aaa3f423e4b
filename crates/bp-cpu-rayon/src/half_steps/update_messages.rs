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

    /// A value of the smoothness cost for the edges of `W` vectors of nodes, by slot. Without `LEVELS`, every edge has the
    /// same value.
    #[inline(always)]
    fn of_edges<S: Simd, V: Vector<S>, const W: usize, const LEVELS: bool>(
        &self,
        simd: S,
        at: usize,
        value: impl Fn(Smoothness) -> u8,
    ) -> [[V; 4]; W] {
        let by_level = self.edges.smoothness().map(value);
        let mut values = [[V::splat(simd, by_level[0]); 4]; W];
        if let Some(around) = self.around.filter(|_| LEVELS) {
            for (w, values) in values.iter_mut().enumerate() {
                for (slot, out) in values.iter_mut().enumerate() {
                    *out = of_levels(simd, around.levels(simd, slot, at + w * V::LEN), by_level);
                }
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

/// Processes a row two vectors at a time while there are enough nodes, then one at a time, then in narrow vectors.
#[inline(always)]
fn row<S: Simd, const LEVELS: bool>(simd: S, nodes: &Nodes<'_>, slots: [&mut [u8]; 4]) {
    let [same, next, up, down] = slots;
    // Slices of one known length let the compiler drop the bounds checks in the loops.
    let len = nodes.costs.len();
    let mut slots = [&mut same[..len], &mut next[..len], &mut up[..len], &mut down[..len]];
    let mut at = 0;
    while at + 2 * S::u8s::LEN <= nodes.nodes {
        vectors::<S, S::u8s, 2, LEVELS>(simd, nodes, &mut slots, at);
        at += 2 * S::u8s::LEN;
    }
    while at + S::u8s::LEN <= nodes.nodes {
        vectors::<S, S::u8s, 1, LEVELS>(simd, nodes, &mut slots, at);
        at += S::u8s::LEN;
    }
    while at < nodes.nodes {
        vectors::<S, u8x16<S>, 1, LEVELS>(simd, nodes, &mut slots, at);
        at += u8x16::<S>::LEN;
    }
}

/// Sends the messages of `W` vectors of nodes. A pass up the labels adds the received messages and starts the lower
/// envelope; a pass down finishes it (Felzenszwalb and Huttenlocher 2006). Between the two passes, the slots hold the
/// envelope.
#[inline(always)]
fn vectors<S, V, const W: usize, const LEVELS: bool>(simd: S, nodes: &Nodes<'_>, slots: &mut [&mut [u8]; 4], at: usize)
where
    S: Simd,
    V: Vector<S>,
{
    let least = pass_up::<S, V, W, LEVELS>(simd, nodes, slots, at);
    pass_down::<S, V, W, LEVELS>(simd, nodes, slots, at, least);
}

/// Writes the upward envelopes to the slots and returns the least entry of each side's h.
#[inline(always)]
#[expect(clippy::needless_range_loop, reason = "iterators keep the vectors in memory: twice as slow")]
fn pass_up<S: Simd, V: Vector<S>, const W: usize, const LEVELS: bool>(
    simd: S,
    nodes: &Nodes<'_>,
    slots: &mut [&mut [u8]; 4],
    at: usize,
) -> [[V; 4]; W] {
    let step = nodes.of_edges::<S, V, W, LEVELS>(simd, at, Smoothness::step);
    let mut masks = [[V::splat(simd, 0); 2]; W];
    for w in 0..W {
        let from = at + w * V::LEN;
        masks[w] = nodes.masks.map(|mask| V::from_slice(simd, &mask[from..from + V::LEN]));
    }
    let mut envelope = [[V::splat(simd, u8::MAX); 4]; W];
    let mut least = envelope;
    let mut start = at;
    while start + W * V::LEN <= nodes.costs.len() {
        for w in 0..W {
            let h = gather::<S, V>(simd, nodes, masks[w], slots, start + w * V::LEN);
            for side in 0..4 {
                envelope[w][side] = envelope[w][side].saturating_add(step[w][side]).min(h[side]);
                least[w][side] = least[w][side].min(envelope[w][side]);
            }
        }
        for w in 0..W {
            let from = start + w * V::LEN;
            for side in 0..4 {
                envelope[w][side].store_slice(&mut slots[side][from..from + V::LEN]);
            }
        }
        start += nodes.lanes;
    }
    least
}

/// Turns the upward envelopes into messages.
#[inline(always)]
fn pass_down<S: Simd, V: Vector<S>, const W: usize, const LEVELS: bool>(
    simd: S,
    nodes: &Nodes<'_>,
    slots: &mut [&mut [u8]; 4],
    at: usize,
    least: [[V; 4]; W],
) {
    let step = nodes.of_edges::<S, V, W, LEVELS>(simd, at, Smoothness::step);
    let truncation = nodes.of_edges::<S, V, W, LEVELS>(simd, at, |smoothness| smoothness.truncation);
    let mut envelope = [[V::splat(simd, u8::MAX); 4]; W];
    let mut start = at + nodes.labels() * nodes.lanes;
    while start > at {
        start -= nodes.lanes;
        // All loads come before the stores: slots often lie a multiple of 4 KiB apart, and a load would have to wait
        // for a store at such a distance.
        for w in 0..W {
            let from = start + w * V::LEN;
            for side in 0..4 {
                let half = V::from_slice(simd, &slots[side][from..from + V::LEN]);
                envelope[w][side] = envelope[w][side].saturating_add(step[w][side]).min(half);
            }
        }
        for w in 0..W {
            let from = start + w * V::LEN;
            for side in 0..4 {
                let message = (envelope[w][side] - least[w][side]).min(truncation[w][side]);
                message.store_slice(&mut slots[side][from..from + V::LEN]);
            }
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
