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

use super::{edges::Rows, refine::slot};
use crate::{
    layout::Layout,
    shape::{Column, PlaneRow, STRIP, Strip},
};

/// The number of labels whose indices fit 8 bits.
const CHUNK: usize = 256;

/// The costs and messages that labels are selected by.
pub(crate) struct Answer<'a> {
    pub(crate) level: Level,
    pub(crate) layout: &'a Layout,
    pub(crate) stored: &'a [u8],
    /// The messages that nodes received, by checkerboard colour.
    pub(crate) received: [Rows<'a>; 2],
}

/// Writes the label with the lowest belief of every node, `[height][width]`.
pub(crate) fn select_labels(answer: &Answer<'_>, labels: &mut [u16]) {
    labels.par_chunks_exact_mut(answer.layout.size.width).enumerate().for_each(|(y, row)| {
        for plane in 0..2 {
            answer.decide(PlaneRow { plane, y }, row);
        }
    });
}

/// The messages that the nodes of a plane received from a side.
#[derive(Clone, Copy)]
struct Received<'a> {
    /// The messages, `[label][lane]`.
    values: &'a [u8],
    /// 255 where a neighbour sent one, otherwise 0, `[lane]`.
    mask: &'a [u8],
}

impl<'a> Answer<'a> {
    /// Copies the messages received from `side`, `[height][width][labels]`.
    pub(crate) fn read_messages(&self, plan: &Plan, side: Side, messages: &mut [u8]) {
        let nodes = (0..).flat_map(|y| self.layout.columns().map(move |column| (column, y)));
        for ((Column { x, plane, lane }, y), out) in nodes.zip(messages.chunks_exact_mut(self.layout.labels)) {
            let there = plan.neighbour(0, Node { x, y }, side).is_some();
            let values = if there { self.received[(x + y) % 2].towards(side, plane, y) } else { None };
            for (label, out) in out.iter_mut().enumerate() {
                *out = values.map_or(0, |values| values[label * self.layout.lanes + lane]);
            }
        }
    }

    fn costs(&self, PlaneRow { plane, y }: PlaneRow) -> &'a [u8] {
        &self.stored[y * self.layout.row() + plane * self.layout.plane()..][..self.layout.plane()]
    }

    fn received(&self, at: PlaneRow, side: Side) -> Received<'a> {
        let [none, _] = self.layout.none_and_all();
        match self.received[at.colour()].towards(side, at.plane, at.y) {
            Some(values) => Received { values, mask: self.mask(at.plane, side) },
            // The mask drops these values.
            None => Received { values: self.costs(at), mask: none },
        }
    }

    /// 255 where a node of `plane` has a neighbour on `side`, `[lane]`. For up and down it is 255 everywhere, because
    /// callers know whether there is such a row.
    fn mask(&self, plane: usize, side: Side) -> &'a [u8] {
        let [_, all] = self.layout.none_and_all();
        self.layout.masks(plane).get(slot(side, plane)).copied().unwrap_or(all)
    }

    /// Decides the labels of the nodes of a plane in a row.
    fn decide(&self, at: PlaneRow, row: &mut [u16]) {
        let nodes = Undecided {
            layout: self.layout,
            costs: self.costs(at),
            received: Side::ALL.map(|side| self.received(at, side)),
        };
        for strip in self.layout.strips(at.plane) {
            let labels = dispatch!(self.level, simd => nodes.strip(simd, strip));
            row.iter_mut().skip(strip.column(at) as usize).step_by(2).zip(labels).for_each(|(out, label)| *out = label);
        }
    }
}

/// The nodes of one plane in one row.
struct Undecided<'a> {
    layout: &'a Layout,
    costs: &'a [u8],
    received: [Received<'a>; 4],
}

impl Undecided<'_> {
    /// Decides the labels of a strip of nodes, one chunk of labels at a time, so that their indices fit 8 bits.
    #[inline(always)]
    fn strip<S: Simd>(&self, simd: S, strip: Strip) -> [u16; STRIP] {
        let mut labels = [0; STRIP];
        let mut best = [u8::MAX; STRIP];
        for from in (0..self.layout.labels).step_by(CHUNK) {
            let before = best;
            let mut index = [0; STRIP];
            for label in from..(from + CHUNK).min(self.layout.labels) {
                self.compare(simd, strip, [label, label - from], &mut best, &mut index);
            }
            for lane in 0..strip.lanes {
                if best[lane] < before[lane] {
                    labels[lane] = from as u16 + u16::from(index[lane]);
                }
            }
        }
        labels
    }

    /// Compares the belief of a label with the best so far. Keeps the better one and its index in the chunk.
    #[inline(always)]
    fn compare<S: Simd>(
        &self,
        simd: S,
        strip: Strip,
        [label, low]: [usize; 2],
        best: &mut [u8; STRIP],
        index: &mut [u8; STRIP],
    ) {
        let (start, lanes) = (label * self.layout.lanes + strip.first, strip.lanes);
        let low = S::u8s::splat(simd, low as u8);
        let costs = &self.costs[start..start + lanes];
        let received = self.received.map(|from| (&from.values[start..start + lanes], strip.of(from.mask)));
        for lane in (0..lanes).step_by(S::u8s::LEN) {
            let range = lane..lane + S::u8s::LEN;
            let load = |values: &[u8]| S::u8s::from_slice(simd, &values[range.clone()]);
            let mut sum = S::u8s::splat(simd, 0);
            for (values, mask) in received {
                sum += load(values) & load(mask);
            }
            // The sum of four messages is at most 4K, so only this addition can saturate.
            let belief = load(costs).saturating_add(sum);
            let least = load(best);
            belief.simd_lt(least).select(low, load(index)).store_slice(&mut index[range.clone()]);
            belief.min(least).store_slice(&mut best[range.clone()]);
        }
    }
}
