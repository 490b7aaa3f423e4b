//! Label selection by the lowest belief.
//!
//! In the terms of `bp-cpu-scalar`, the kernel computes for every node:
//!
//! ```text
//! for each label d:   belief(d) = cost(d) + the messages received from all sides (d)
//! label = the smallest d with the lowest belief
//! ```
//!
//! Here one lane of a vector is one node. It keeps the best belief and its label during the loop over all labels.

use fearless_simd::{Level, Select, Simd, SimdBase, SimdInt, dispatch};

use super::{
    edges::{OfBlock, Received},
    update_messages::Nodes,
};
use crate::block::{Block, Bytes, LANES};

/// The number of labels whose indices fit 8 bits.
const CHUNK: usize = 256;

/// Writes the labels of the nodes of a plane in a row; see [`super::Labels`]. `received` are the messages by slot.
pub(crate) fn select_labels(
    level: Level,
    nodes: &Nodes<'_>,
    received: [Option<Received<'_>>; 4],
    labels: &mut [Block],
) {
    if received[1].is_some_and(|received| received.is_moved()) {
        dispatch!(level, simd => nodes.decide::<_, true>(simd, received, labels));
    } else {
        dispatch!(level, simd => nodes.decide::<_, false>(simd, received, labels));
    }
}

impl Nodes<'_> {
    /// Decides block by block. `MOVED` says whether what came over the second slot is; see [`super::edges`].
    #[inline(always)]
    fn decide<S: Simd, const MOVED: bool>(&self, simd: S, received: [Option<Received<'_>>; 4], labels: &mut [Block]) {
        for (block, out) in labels.as_chunks_mut::<2>().0.iter_mut().enumerate() {
            let costs = &self.costs[self.shape.block(block)];
            let [same, next] =
                self.masks.map(|mask| Bytes::from_slice(simd, &mask[LANES * block..LANES * (block + 1)]));
            let of_rows =
                [2, 3].map(|slot: usize| Bytes::splat(simd, if received[slot].is_some() { u8::MAX } else { 0 }));
            let undecided = Undecided {
                costs,
                received: received
                    .map(|received| received.map_or(OfBlock::any(costs), |received| received.block(block))),
                masks: [same, next, of_rows[0], of_rows[1]],
            };
            let labels = undecided.decide::<MOVED>(simd);
            for (lane, label) in labels.into_iter().enumerate() {
                [out[0].0[lane], out[1].0[lane]] = label.to_le_bytes();
            }
        }
    }
}

/// A block of nodes.
struct Undecided<'a, S: Simd> {
    costs: &'a [Block],
    received: [OfBlock<'a>; 4],
    masks: [Bytes<S>; 4],
}

impl<S: Simd> Undecided<'_, S> {
    /// Decides the labels, one chunk of labels at a time, so that their indices fit 8 bits.
    #[inline(always)]
    fn decide<const MOVED: bool>(&self, simd: S) -> [u16; LANES] {
        let mut labels = [0; LANES];
        let mut best = [u8::MAX; LANES];
        for (chunk, costs) in self.costs.chunks(CHUNK).enumerate() {
            let first = CHUNK * chunk;
            let received = self.received.map(|received| received.part(first..first + costs.len()));
            let before = best;
            let index = self.compare::<MOVED>(simd, costs, received, &mut best);
            for lane in (0..LANES).filter(|&lane| best[lane] < before[lane]) {
                labels[lane] = first as u16 + u16::from(index[lane]);
            }
        }
        labels
    }

    /// Compares the beliefs of a chunk of labels with the best so far. Keeps the best and returns their indices in the chunk.
    #[inline(always)]
    fn compare<const MOVED: bool>(
        &self,
        simd: S,
        costs: &[Block],
        [same, next, up, down]: [OfBlock<'_>; 4],
        best: &mut [u8; LANES],
    ) -> [u8; LANES] {
        let (masks, mut least, mut index) = (self.masks, Bytes::load_array(simd, *best), Bytes::splat(simd, 0));
        for (low, cost) in costs.iter().enumerate() {
            let of_next = if MOVED { next.load_moved(simd, low) } else { next.load_in_place(simd, low) };
            let [of_same, of_up, of_down] = [same, up, down].map(
                #[inline(always)]
                |received| received.load_in_place(simd, low),
            );
            let sum = (of_same & masks[0]) + (of_next & masks[1]) + (of_up & masks[2]) + (of_down & masks[3]);
            // The sum of four messages is at most 4K, so only this addition can saturate.
            let belief = cost.load(simd).saturating_add(sum);
            index = belief.simd_lt(least).select(Bytes::splat(simd, low as u8), index);
            least = least.min(belief);
        }
        *best = least.into();
        index.into()
    }
}
