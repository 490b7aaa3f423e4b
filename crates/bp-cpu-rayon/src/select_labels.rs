//! Labels: those of least belief, or in sequence, given the labels already decided.

use std::array;

use bp_core::{MAX_TRUNCATION, Model, Node, Plan, Schedule, Side, Smoothness};
use fearless_simd::{Level, Select, Simd, SimdBase, SimdInt, dispatch};
use rayon::prelude::*;

use crate::{edges::Rows, greys::Around, layout::Layout, refine::slot, shape::STRIP};

/// A distance of labels that costs the truncation whatever the slope is, unless that is 0.
const FAR: usize = MAX_TRUNCATION as usize + 1;

/// Labels that are compared at a time: as many as let distances to decided labels, clamped to [`FAR`] beyond either end,
/// stay within 8 bits.
const CHUNK: usize = 256 - 2 * FAR;

/// What labels are read off: rows of a grid from row `first` on.
pub(crate) struct Answer<'a> {
    pub(crate) level: Level,
    pub(crate) model: &'a Model,
    pub(crate) layout: &'a Layout,
    pub(crate) first: usize,
    pub(crate) stored: &'a [u8],
    /// What nodes of either checkerboard colour received.
    pub(crate) received: [Rows<'a>; 2],
}

/// Writes the smallest label of least belief of every node, `[height][width]`.
pub(crate) fn select_labels(answer: &Answer<'_>, labels: &mut [u16]) {
    labels.par_chunks_exact_mut(answer.layout.size.width).enumerate().for_each(|(y, row)| {
        for plane in 0..2 {
            let received = Side::ALL.map(|side| answer.received((plane, y), side));
            answer.decide((plane, y), received, |_, _| [], row);
        }
    });
}

/// What the nodes of a plane received from a side, `[label][lane]`, and where there is a node that sent it, `[lane]`.
type Received<'a> = (&'a [u8], &'a [u8]);

impl<'a> Answer<'a> {
    fn costs(&self, plane: usize, y: usize) -> &'a [u8] {
        &self.stored[(y - self.first) * self.layout.row() + plane * self.layout.plane()..][..self.layout.plane()]
    }

    /// Copies out what the nodes of as many rows as `messages` has room for received from `side`.
    pub(crate) fn read_messages(&self, plan: &Plan, side: Side, messages: &mut [u8]) {
        let one_an_edge = plan.settings().schedule == Schedule::Sweep;
        let nodes = (self.first..).flat_map(|y| self.layout.columns().map(move |column| (column, y)));
        for (((x, plane, lane), y), out) in nodes.zip(messages.chunks_exact_mut(self.layout.labels)) {
            let colour = (x + y) % 2;
            let went_away = one_an_edge && (side == Side::Up || side != Side::Down && colour == 1);
            let there = plan.neighbour(0, Node { x, y }, side).is_some() && !went_away;
            let values = if there { self.received[colour].towards(side, plane, y) } else { None };
            for (label, out) in out.iter_mut().enumerate() {
                *out = values.map_or(0, |values| values[label * self.layout.lanes + lane]);
            }
        }
    }

    fn received(&self, (plane, y): (usize, usize), side: Side) -> Received<'a> {
        let [none, _] = self.layout.none_and_all();
        match self.received[(plane + y) % 2].towards(side, plane, y) {
            Some(values) => (values, self.mask(plane, side)),
            // Any values will do where none counts.
            None => (self.costs(plane, y), none),
        }
    }

    /// Where the nodes of `plane` have a neighbour on `side`, `[lane]`; of up and down the rows know.
    fn mask(&self, plane: usize, side: Side) -> &'a [u8] {
        let [_, all] = self.layout.none_and_all();
        self.layout.masks(plane).get(slot(side, plane)).copied().unwrap_or(all)
    }

    /// Decodes a band after sweeps, from its first row down, even nodes before odd ones.
    pub(crate) fn decode_band(&self, labels: &mut [u16]) {
        let mut above = None;
        for (row, y) in labels.chunks_exact_mut(self.layout.size.width).zip(self.first..) {
            let (even, odd) = (y % 2, 1 - y % 2);
            let above_row = above.filter(|_| self.layout.joined_above(y));
            let up = |strip, column| Known {
                slot: slot(Side::Up, even),
                labels: decided(above_row.unwrap_or_default(), column),
                mask: part(self.layout.none_and_all()[usize::from(above_row.is_some())], strip),
            };
            let [left, right, _, down] = Side::ALL.map(|side| self.received((even, y), side));
            self.decide((even, y), [left, right, down], |(strip, column), _| [up(strip, column)], row);
            let beside = |side, (strip, column): (_, isize), row: &[u16]| {
                let dx = if side == Side::Left { -1 } else { 1 };
                Known {
                    slot: slot(side, odd),
                    labels: decided(row, column + dx),
                    mask: part(self.mask(odd, side), strip),
                }
            };
            let down = self.received((odd, y), Side::Down);
            let known = |(strip, column), row: &[u16]| {
                let at = (strip, column);
                [up(strip, column), beside(Side::Left, at, row), beside(Side::Right, at, row)]
            };
            self.decide((odd, y), [down], known, row);
            above = Some(&*row);
        }
    }

    /// Decides the nodes of `plane` in row `y`: the smallest label that costs least with what was received from some
    /// sides and with the labels already decided on others: `known` tells those for a strip of lanes and its first
    /// column.
    fn decide<'b, const M: usize, const K: usize>(
        &self,
        (plane, y): (usize, usize),
        received: [Received<'_>; M],
        known: impl Fn(((usize, usize), isize), &[u16]) -> [Known<'b>; K],
        row: &mut [u16],
    ) {
        let nodes = Undecided { layout: self.layout, model: self.model, costs: self.costs(plane, y) };
        let around = self.layout.around(plane, y).filter(|_| K > 0);
        for strip in self.layout.strips(plane) {
            let column = 2 * strip.0 + plane;
            let known = known((strip, column as isize), row);
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
            row.iter_mut().skip(column).step_by(2).zip(labels).for_each(|(out, label)| *out = label);
        }
    }
}

/// The lanes of a strip.
fn part(lanes: &[u8], (at, count): (usize, usize)) -> &[u8] {
    &lanes[at..at + count]
}

/// Labels of every second column from `x` on; 0 outside.
fn decided(row: &[u16], x: isize) -> [u16; STRIP] {
    let mut labels = [0; STRIP];
    let first = usize::from(x < 0);
    let columns = row.get(x.max(x + 2 * first as isize) as usize..).unwrap_or_default();
    labels[first..].iter_mut().zip(columns.iter().step_by(2)).for_each(|(label, &decided)| *label = decided);
    labels
}

/// Decided labels of neighbours of a strip of nodes, and where there are any.
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
    /// Step and truncation of the edges to decided labels, for a strip of nodes.
    #[inline(always)]
    fn edges<S: Simd, const K: usize>(
        &self,
        simd: S,
        (at, lanes): (usize, usize),
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
                    for lane in (0..lanes).step_by(S::u8s::LEN) {
                        for (edge, values) in edges.iter_mut().zip([step, truncation]) {
                            let chosen: S::u8s = around.choose(simd, known.slot, at + lane, values);
                            chosen.store_slice(&mut edge[lane..lane + S::u8s::LEN]);
                        }
                    }
                    edges
                })
            },
        )
    }

    /// Decides a strip of nodes, chunk by chunk of labels, since what is compared has 8 bits.
    #[inline(always)]
    fn strip<S: Simd, const WEAK: bool, const M: usize, const K: usize>(
        &self,
        simd: S,
        strip: (usize, usize),
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
                            (label, label - from),
                            received,
                            &near,
                            &mut best,
                            &mut index,
                        );
                    }
                    for lane in 0..strip.1 {
                        if best[lane] < before[lane] {
                            labels[lane] = from as u16 + u16::from(index[lane]);
                        }
                    }
                }
                labels
            },
        )
    }

    /// Compares the cost of a label, of which its place in the chunk is written down, with the best so far.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "the state of one loop")]
    fn compare<S: Simd, const WEAK: bool, const M: usize, const K: usize>(
        &self,
        simd: S,
        (at, lanes): (usize, usize),
        (label, low): (usize, usize),
        received: &[Received<'_>; M],
        near: &[Near<'_>; K],
        best: &mut [u8; STRIP],
        index: &mut [u8; STRIP],
    ) {
        let start = label * self.layout.lanes + at;
        let (usual, far) = (self.model.smoothness(), far(self.model, WEAK));
        let here = S::u8s::splat(simd, (low + FAR) as u8);
        let low = S::u8s::splat(simd, low as u8);
        let costs = &self.costs[start..start + lanes];
        let received = received.map(|(values, mask)| (&values[start..start + lanes], &mask[at..at + lanes]));
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
            // What is added to the data cost is at most 4K.
            let belief = load(costs).saturating_add(sum);
            let least = load(best);
            belief.simd_lt(least).select(low, load(index)).store_slice(&mut index[range.clone()]);
            belief.min(least).store_slice(&mut best[range.clone()]);
        }
    }
}

/// Labels relative to a chunk of labels, clamped to where distances count, and where there are any.
struct Near<'a> {
    labels: [u8; STRIP],
    mask: &'a [u8],
    /// Step and truncation of the edges to them, where some are weak.
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

/// The least distance of labels that costs the truncation over every edge. Times the step it fits 8 bits: s div 2 is at
/// least a third of s, or 0.
fn far(model: &Model, weak: bool) -> u8 {
    let far = |edge: Smoothness| edge.truncation.checked_div(edge.step()).map_or(0, |far| far + 1);
    let usual = model.smoothness();
    if weak { far(usual).max(far(usual.weakened())) } else { far(usual) }
}
