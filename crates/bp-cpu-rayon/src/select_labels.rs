//! Label selection: by the lowest belief, or in sequence, given the labels already decided.
//!
//! In the terms of `bp-cpu-scalar`, the kernel computes for every node:
//!
//! ```text
//! for each label d:
//!     belief(d) = cost(d) + messages from the sides without a decided label (d)
//!                         + smoothness(d, label decided there) for the other sides
//! label = the smallest d with the lowest belief
//! ```
//!
//! Here one lane of a vector is one node. It keeps the best belief and its label during the loop over all labels.

use std::array;

use bp_core::{MAX_TRUNCATION, Model, Node, Plan, Schedule, Side, Smoothness};
use fearless_simd::{Level, Select, Simd, SimdBase, SimdInt, dispatch};
use rayon::prelude::*;

use crate::{
    edges::Rows,
    greys::Around,
    layout::Layout,
    refine::slot,
    shape::{Column, PlaneRow, STRIP, Strip},
};

/// A distance of labels that costs the truncation for every slope but 0.
const FAR: usize = MAX_TRUNCATION as usize + 1;

/// The number of labels compared at a time. Decided labels are clamped to [`FAR`] beyond either end of such a chunk, so
/// distances to them stay within 8 bits.
const CHUNK: usize = 256 - 2 * FAR;

/// The costs and messages that labels are selected by, for rows from `first` on.
pub(crate) struct Answer<'a> {
    pub(crate) level: Level,
    pub(crate) model: &'a Model,
    pub(crate) layout: &'a Layout,
    pub(crate) first: usize,
    pub(crate) stored: &'a [u8],
    /// The messages that nodes received, by checkerboard colour.
    pub(crate) received: [Rows<'a>; 2],
}

/// Writes the label with the lowest belief of every node, `[height][width]`.
pub(crate) fn select_labels(answer: &Answer<'_>, labels: &mut [u16]) {
    labels.par_chunks_exact_mut(answer.layout.size.width).enumerate().for_each(|(y, row)| {
        for plane in 0..2 {
            let at = PlaneRow { plane, y };
            let received = Side::ALL.map(|side| answer.received(at, side));
            answer.decide(at, received, |_, _| [], row);
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
    fn costs(&self, PlaneRow { plane, y }: PlaneRow) -> &'a [u8] {
        &self.stored[(y - self.first) * self.layout.row() + plane * self.layout.plane()..][..self.layout.plane()]
    }

    /// Copies the messages received from `side` to `messages`, for as many rows as fit.
    pub(crate) fn read_messages(&self, plan: &Plan, side: Side, messages: &mut [u8]) {
        let one_an_edge = plan.settings().schedule == Schedule::Sweep;
        let nodes = (self.first..).flat_map(|y| self.layout.columns().map(move |column| (column, y)));
        for ((Column { x, plane, lane }, y), out) in nodes.zip(messages.chunks_exact_mut(self.layout.labels)) {
            let colour = (x + y) % 2;
            let went_away = one_an_edge && (side == Side::Up || side != Side::Down && colour == 1);
            let there = plan.neighbour(0, Node { x, y }, side).is_some() && !went_away;
            let values = if there { self.received[colour].towards(side, plane, y) } else { None };
            for (label, out) in out.iter_mut().enumerate() {
                *out = values.map_or(0, |values| values[label * self.layout.lanes + lane]);
            }
        }
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

    /// Decides the labels of a band after its sweeps, row by row downwards, even nodes before odd ones.
    pub(crate) fn decode_band(&self, above: Option<&[u16]>, labels: &mut [u16]) {
        let mut above = above;
        for (row, y) in labels.chunks_exact_mut(self.layout.size.width).zip(self.first..) {
            let (even, odd) = (PlaneRow { plane: y % 2, y }, PlaneRow { plane: 1 - y % 2, y });
            let above_row = above.filter(|_| self.layout.joined_above(y));
            let up = |strip: Strip, column| Known {
                slot: slot(Side::Up, even.plane),
                labels: decided(above_row.unwrap_or_default(), column),
                mask: strip.of(self.layout.none_and_all()[usize::from(above_row.is_some())]),
            };
            let [left, right, _, down] = Side::ALL.map(|side| self.received(even, side));
            self.decide(even, [left, right, down], |strip, _| [up(strip, strip.column(even))], row);
            let beside = |side, strip: Strip, row: &[u16]| {
                let dx = if side == Side::Left { -1 } else { 1 };
                Known {
                    slot: slot(side, odd.plane),
                    labels: decided(row, strip.column(odd) + dx),
                    mask: strip.of(self.mask(odd.plane, side)),
                }
            };
            let down = self.received(odd, Side::Down);
            let known = |strip: Strip, row: &[u16]| {
                [up(strip, strip.column(odd)), beside(Side::Left, strip, row), beside(Side::Right, strip, row)]
            };
            self.decide(odd, [down], known, row);
            above = Some(&*row);
        }
    }

    /// Decides the labels of the nodes of a plane in a row. Each node takes the label with the lowest cost, given the
    /// messages from some sides and the labels already decided on the others; the smallest label wins a tie. `known`
    /// returns the decided labels for a strip.
    fn decide<'b, const M: usize, const K: usize>(
        &self,
        at: PlaneRow,
        received: [Received<'_>; M],
        known: impl Fn(Strip, &[u16]) -> [Known<'b>; K],
        row: &mut [u16],
    ) {
        let nodes = Undecided { layout: self.layout, model: self.model, costs: self.costs(at) };
        let around = self.layout.around(at.plane, at.y).filter(|_| K > 0);
        for strip in self.layout.strips(at.plane) {
            let known = known(strip, row);
            let labels = match around {
                Some(around) => {
                    let edges = dispatch!(self.level, simd => nodes.edges(simd, strip, around, &known));
                    let edges = edges.each_ref().map(|edge| edge.each_ref().map(<[u8; STRIP]>::as_slice));
                    dispatch!(self.level, simd => nodes.strip::<_, true, _, _>(simd, strip, &received, &known, &edges))
                }
                None => {
                    let none = [[[].as_slice(); 2]; K];
                    dispatch!(self.level, simd => nodes.strip::<_, false, _, _>(simd, strip, &received, &known, &none))
                }
            };
            row.iter_mut().skip(strip.column(at) as usize).step_by(2).zip(labels).for_each(|(out, label)| *out = label);
        }
    }
}

/// The labels of every second column from `x` on; 0 outside the image.
fn decided(row: &[u16], x: isize) -> [u16; STRIP] {
    let mut labels = [0; STRIP];
    let first = usize::from(x < 0);
    let columns = row.get(x.max(x + 2 * first as isize) as usize..).unwrap_or_default();
    labels[first..].iter_mut().zip(columns.iter().step_by(2)).for_each(|(label, &decided)| *label = decided);
    labels
}

/// A label to compare with the best so far.
#[derive(Clone, Copy)]
struct Candidate {
    label: usize,
    /// Its index in the chunk.
    low: usize,
}

/// The decided labels of the neighbours of a strip of nodes, and which of these neighbours exist.
struct Known<'a> {
    slot: usize,
    labels: [u16; STRIP],
    mask: &'a [u8],
}

/// The nodes of one plane in one row.
struct Undecided<'a> {
    layout: &'a Layout,
    model: &'a Model,
    costs: &'a [u8],
}

impl Undecided<'_> {
    /// The step and the truncation of the edges to decided labels, for a strip of nodes.
    #[inline(always)]
    fn edges<S: Simd, const K: usize>(
        &self,
        simd: S,
        strip: Strip,
        around: Around<'_>,
        known: &[Known<'_>; K],
    ) -> [[[u8; STRIP]; 2]; K] {
        simd.vectorize(
            #[inline(always)]
            || {
                let usual = self.model.smoothness();
                let (step, truncation) = (
                    [usual, usual.weakened()].map(Smoothness::step),
                    [usual, usual.weakened()].map(|smoothness| smoothness.truncation),
                );
                known.each_ref().map(|known| {
                    let mut edges = [[0; STRIP]; 2];
                    for lane in (0..strip.lanes).step_by(S::u8s::LEN) {
                        for (edge, values) in edges.iter_mut().zip([step, truncation]) {
                            let chosen: S::u8s = around.choose(simd, known.slot, strip.first + lane, values);
                            chosen.store_slice(&mut edge[lane..lane + S::u8s::LEN]);
                        }
                    }
                    edges
                })
            },
        )
    }

    /// Decides the labels of a strip of nodes, one chunk of labels at a time, so that distances fit 8 bits.
    #[inline(always)]
    fn strip<S: Simd, const WEAK: bool, const M: usize, const K: usize>(
        &self,
        simd: S,
        strip: Strip,
        received: &[Received<'_>; M],
        known: &[Known<'_>; K],
        edges: &[[&[u8]; 2]; K],
    ) -> [u16; STRIP] {
        simd.vectorize(
            #[inline(always)]
            || {
                let mut labels = [0; STRIP];
                let mut best = [u8::MAX; STRIP];
                for from in (0..self.layout.labels).step_by(CHUNK) {
                    let near: [Near<'_>; K] = array::from_fn(|i| Near {
                        labels: near(&known[i], from),
                        mask: known[i].mask,
                        edges: edges[i],
                    });
                    let before = best;
                    let mut index = [0; STRIP];
                    for label in from..(from + CHUNK).min(self.layout.labels) {
                        self.compare::<S, WEAK, M, K>(
                            simd,
                            strip,
                            Candidate { label, low: label - from },
                            received,
                            &near,
                            &mut best,
                            &mut index,
                        );
                    }
                    for lane in 0..strip.lanes {
                        if best[lane] < before[lane] {
                            labels[lane] = from as u16 + u16::from(index[lane]);
                        }
                    }
                }
                labels
            },
        )
    }

    /// Compares the belief of a label with the best so far. Keeps the better one and its index in the chunk.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "the state of one loop")]
    fn compare<S: Simd, const WEAK: bool, const M: usize, const K: usize>(
        &self,
        simd: S,
        strip: Strip,
        candidate: Candidate,
        received: &[Received<'_>; M],
        near: &[Near<'_>; K],
        best: &mut [u8; STRIP],
        index: &mut [u8; STRIP],
    ) {
        let Candidate { label, low } = candidate;
        let (start, lanes) = (label * self.layout.lanes + strip.first, strip.lanes);
        let (usual, far) = (self.model.smoothness(), far(self.model, WEAK));
        let here = S::u8s::splat(simd, (low + FAR) as u8);
        let low = S::u8s::splat(simd, low as u8);
        let costs = &self.costs[start..start + lanes];
        let received = received.map(|from| (&from.values[start..start + lanes], strip.of(from.mask)));
        for lane in (0..lanes).step_by(S::u8s::LEN) {
            let range = lane..lane + S::u8s::LEN;
            let load = |values: &[u8]| S::u8s::from_slice(simd, &values[range.clone()]);
            let mut sum = S::u8s::splat(simd, 0);
            for (values, mask) in received {
                sum += load(values) & load(mask);
            }
            for near in near {
                let label = load(&near.labels);
                let distance = here.saturating_sub(label) | label.saturating_sub(here);
                let [step, truncation] = if WEAK {
                    near.edges.map(load)
                } else {
                    [usual.step(), usual.truncation].map(|value| S::u8s::splat(simd, value))
                };
                let smoothness = (distance.min(S::u8s::splat(simd, far)) * step).min(truncation);
                sum += smoothness & load(near.mask);
            }
            // The sum of four messages or smoothness costs is at most 4K, so only this addition can saturate.
            let belief = load(costs).saturating_add(sum);
            let least = load(best);
            belief.simd_lt(least).select(low, load(index)).store_slice(&mut index[range.clone()]);
            belief.min(least).store_slice(&mut best[range.clone()]);
        }
    }
}

/// Decided labels relative to a chunk of labels, clamped to [`FAR`] beyond its ends.
struct Near<'a> {
    labels: [u8; STRIP],
    mask: &'a [u8],
    /// The step and the truncation of the edges to them, if there are weak edges.
    edges: [&'a [u8]; 2],
}

#[inline(always)]
fn near(known: &Known<'_>, from: usize) -> [u8; STRIP] {
    let mut relative = [0; STRIP];
    for (relative, &label) in relative.iter_mut().zip(&known.labels) {
        *relative = (label + FAR as u16).saturating_sub(from as u16).min(255) as u8;
    }
    relative
}

/// A distance of labels from which on every edge costs its truncation. Its product with the step fits 8 bits, because
/// s div 2 is at least a third of s, or 0.
fn far(model: &Model, weak: bool) -> u8 {
    let far = |edge: Smoothness| edge.truncation.checked_div(edge.step()).map_or(0, |far| far + 1);
    let usual = model.smoothness();
    if weak { far(usual).max(far(usual.weakened())) } else { far(usual) }
}
