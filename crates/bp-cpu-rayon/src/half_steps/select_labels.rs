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

use bp_core::{Node, Plan, Side};
use fearless_simd::{Level, Select, Simd, SimdBase, SimdInt, dispatch};
use rayon::prelude::*;

use super::{
    edges::{OfBlock, Rows},
    refine::slot,
};
use crate::{
    block::{Block, Bytes, LANES},
    layout::Layout,
    shape::{Column, PlaneRow},
};

/// The number of labels whose indices fit 8 bits.
const CHUNK: usize = 256;

/// The costs and messages that labels are selected by.
pub(crate) struct Answer<'a> {
    pub(crate) level: Level,
    pub(crate) layout: &'a Layout,
    pub(crate) stored: &'a [Block],
    /// The messages that nodes received, by checkerboard colour.
    pub(crate) received: [Rows<'a>; 2],
}

/// Writes the label with the lowest belief of every node, `[height][width]`.
pub(crate) fn select_labels(answer: &Answer<'_>, labels: &mut [u16]) {
    labels.par_chunks_exact_mut(answer.layout.size.width).enumerate().for_each(|(y, row)| {
        dispatch!(answer.level, simd => {
            answer.decide::<_, false>(simd, PlaneRow { plane: 0, y }, row);
            answer.decide::<_, true>(simd, PlaneRow { plane: 1, y }, row);
        });
    });
}

impl Answer<'_> {
    /// Copies the messages received from `side`, `[height][width][labels]`.
    pub(crate) fn read_messages(&self, plan: &Plan, side: Side, messages: &mut [u8]) {
        let nodes = (0..).flat_map(|y| self.layout.columns().map(move |column| (column, y)));
        for ((Column { x, plane, lane }, y), out) in nodes.zip(messages.chunks_exact_mut(self.layout.labels)) {
            let there = plan.neighbour(0, Node { x, y }, side).is_some();
            let received = if there { self.received[(x + y) % 2].towards(side, plane, y) } else { None };
            for (label, out) in out.iter_mut().enumerate() {
                *out = received.map_or(0, |received| received.value(label, lane));
            }
        }
    }

    /// Decides the labels of the nodes of a plane in a row. `MOVED` says whether what they received from the right is; see
    /// [`super::edges`].
    #[inline(always)]
    fn decide<S: Simd, const MOVED: bool>(&self, simd: S, at: PlaneRow, row: &mut [u16]) {
        let PlaneRow { plane, y } = at;
        let costs = &self.stored[y * self.layout.row() + plane * self.layout.plane()..][..self.layout.plane()];
        let received = Side::ALL.map(|side| self.received[at.colour()].towards(side, plane, y));
        for block in 0..self.layout.blocks {
            let costs = &costs[self.layout.block(block)];
            let mut undecided =
                Undecided { costs, received: [OfBlock::any(costs); 4], masks: [Bytes::<S>::splat(simd, 0); 4] };
            for (index, side) in Side::ALL.into_iter().enumerate() {
                if let Some(received) = received[index] {
                    undecided.received[index] = received.block(block);
                    undecided.masks[index] = self.mask(simd, plane, side, block);
                }
            }
            let labels = undecided.decide::<MOVED>(simd);
            let first = (2 * LANES * block + plane).min(row.len());
            row[first..].iter_mut().step_by(2).zip(labels).for_each(|(out, label)| *out = label);
        }
    }

    /// 255 where a node of a block has a neighbour on `side`. For up and down it is 255 everywhere, because callers know whether
    /// there is such a row.
    #[inline(always)]
    fn mask<S: Simd>(&self, simd: S, plane: usize, side: Side, block: usize) -> Bytes<S> {
        match self.layout.masks(plane).get(slot(side, plane)) {
            Some(mask) => Bytes::from_slice(simd, &mask[LANES * block..LANES * (block + 1)]),
            None => Bytes::splat(simd, u8::MAX),
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
        [left, right, up, down]: [OfBlock<'_>; 4],
        best: &mut [u8; LANES],
    ) -> [u8; LANES] {
        let (masks, mut least, mut index) = (self.masks, Bytes::load_array(simd, *best), Bytes::splat(simd, 0));
        for (low, cost) in costs.iter().enumerate() {
            let of_right = if MOVED { right.load_moved(simd, low) } else { right.load_in_place(simd, low) };
            let [of_left, of_up, of_down] = [left, up, down].map(
                #[inline(always)]
                |received| received.load_in_place(simd, low),
            );
            let sum = (of_left & masks[0]) + (of_right & masks[1]) + (of_up & masks[2]) + (of_down & masks[3]);
            // The sum of four messages is at most 4K, so only this addition can saturate.
            let belief = cost.load(simd).saturating_add(sum);
            index = belief.simd_lt(least).select(Bytes::splat(simd, low as u8), index);
            least = least.min(belief);
        }
        *best = least.into();
        index.into()
    }
}
