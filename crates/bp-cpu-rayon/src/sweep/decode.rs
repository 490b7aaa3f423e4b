//! Labels of swept rows, decided one after another; see [`bp_core::Schedule::Sweep`].
//!
//! In the terms of `bp-cpu-scalar`, the kernel computes for every node:
//!
//! ```text
//! for each label d of the node's list:
//!     sum(d) = cost(d) + messages from the sides without a decided label (d)
//!                      + smoothness(d, label decided there) for the other sides
//! label = the smallest d with the lowest sum
//! ```

use std::{mem, ops::Range};

use bp_core::{EdgeLevels, MAX_TRUNCATION, Model};
use fearless_simd::{Select, Simd, SimdBase, SimdInt, dispatch};

use super::{
    Sweep,
    decided::Labels,
    edges::{levels, of_edges, of_sides},
    lists::List,
    messages::Place,
    padded::Padded,
    pass::Pass,
};
use crate::{
    block::{Block, Bytes, LANES},
    greys::Around,
};

impl Pass<'_> {
    /// Decides the labels of these rows, `[row][width]`, given those of the row above, if there are any.
    pub(crate) fn decode(&mut self, rows: Range<usize>, above: Option<&[u16]>, labels: &mut [u16]) {
        let Sweep { level, layout, .. } = *self.sweep;
        if let Some(above) = above {
            // Two rows have the same place, and this one needs not exist.
            self.work.decided.read(rows.start + 1, above);
        }
        for (row, y) in labels.chunks_exact_mut(layout.size.width).zip(rows.clone()) {
            let joined = (y > rows.start || above.is_some()) && layout.joined_above(y);
            dispatch!(level, simd => self.decode_row(simd, y, joined, row));
        }
    }

    #[inline(always)]
    fn decode_row<S: Simd>(&mut self, simd: S, y: usize, has_above: bool, row: &mut [u16]) {
        let mut decided = mem::take(&mut self.work.decided);
        // Even nodes come first.
        for patch in 0..self.lists.patches() {
            let known = [decided.of(y + 1, y % 2, patch, 0); 3];
            let labels = self.decide::<_, false>(simd, patch, y, has_above, known);
            decided.write(y, y % 2, patch, &labels);
        }
        let (plane, other) = (1 - y % 2, y % 2);
        for patch in 0..self.lists.patches() {
            let beside = decided.of(y, other, patch, if plane == 0 { -1 } else { 1 });
            let known = [decided.of(y, other, patch, 0), beside, decided.of(y + 1, plane, patch, 0)];
            let labels = self.decide::<_, true>(simd, patch, y, has_above, known);
            decided.write(y, plane, patch, &labels);
        }
        decided.copy_to(y, row);
        self.work.decided = decided;
    }

    /// Decides the labels of the even or the odd nodes of a patch. `known` are labels by slot: of the neighbour in the same pair of
    /// columns, of that in the next pair, and of that above. Even nodes make use of the last only.
    #[inline(always)]
    fn decide<S: Simd, const ODD: bool>(
        &self,
        simd: S,
        patch: usize,
        y: usize,
        has_above: bool,
        known: [&Labels; 3],
    ) -> Labels {
        let plane = if ODD { 1 - y % 2 } else { y % 2 };
        let (entries, range) = (self.lists.entries(), self.lists.range(patch));
        let place = Place { entries, row: y - self.rows.start, plane, range: &range };
        let messages = self.messages.at(&place);
        let undecided = Undecided {
            plane,
            list: self.lists.list(patch),
            costs: self.work.costs(self.sweep, patch, y, &place),
            same: messages.same,
            next: messages.next,
            below: messages.below,
            model: self.sweep.plan.model(),
            lane: LANES * patch,
            masks: self.masks(plane, has_above),
            greys: self.sweep.layout.around(plane, y),
        };
        if undecided.greys.is_some() {
            undecided.decide::<_, ODD, true>(simd, known)
        } else {
            undecided.decide::<_, ODD, false>(simd, known)
        }
    }

    /// By slot, 255 where a node has a neighbour, `[lane]`.
    fn masks(&self, plane: usize, has_above: bool) -> [&[u8]; 3] {
        let [same, next] = self.sweep.layout.masks(plane);
        [same, next, self.sweep.layout.none_and_all()[usize::from(has_above)]]
    }
}

/// The nodes of a block.
struct Undecided<'a> {
    plane: usize,
    list: List<'a>,
    costs: &'a [Block],
    same: &'a [Block],
    next: &'a [Padded],
    below: &'a [Block],
    model: &'a Model,
    /// The first lane of the block, in the arrays that follow.
    lane: usize,
    masks: [&'a [u8]; 3],
    greys: Option<Around<'a>>,
}

impl Undecided<'_> {
    /// Decides their labels, one chunk of labels at a time. `known` are the labels on both sides and above.
    #[inline(always)]
    fn decide<S: Simd, const ODD: bool, const LEVELS: bool>(&self, simd: S, known: [&Labels; 3]) -> Labels {
        let edges = Edges::<S>::new::<LEVELS>(simd, self);
        let mut labels = [0; LANES];
        let mut best = Bytes::<S>::splat(simd, u8::MAX);
        let mut entry = 0;
        while entry < self.list.labels.len() {
            let from = self.list.labels[entry];
            let end = self.chunk_end(entry, &edges);
            let before = best;
            let nearest = self.chunk::<S, ODD, LEVELS>(simd, entry..end, known, &edges, &mut best);
            let better = best.simd_lt(before).select(Bytes::splat(simd, 1), Bytes::splat(simd, 0));
            let (better, nearest): ([u8; LANES], [u8; LANES]) = (better.into(), nearest.into());
            for ((label, better), nearest) in labels.iter_mut().zip(better).zip(nearest) {
                // By masks, because compilers may make branches of conditions.
                let better = u16::from(better).wrapping_neg();
                *label = (from.wrapping_add(nearest.into()) & better) | (*label & !better);
            }
            entry = end;
        }
        labels
    }

    /// The end of the chunk that begins with an entry.
    #[inline(always)]
    fn chunk_end<S: Simd>(&self, entry: usize, edges: &Edges<S>) -> usize {
        let labels = &self.list.labels[entry..];
        let inside = |label: u16| label - labels[0] <= edges.reach;
        // Mostly all of them.
        let all = labels.last().is_none_or(|&last| inside(last));
        entry + if all { labels.len() } else { labels.partition_point(|&label| inside(label)) }
    }

    /// Compares these entries with the best so far, and returns for each node the label of the best of them, counted from the
    /// first.
    #[inline(always)]
    fn chunk<S: Simd, const ODD: bool, const LEVELS: bool>(
        &self,
        simd: S,
        entries: Range<usize>,
        known: [&Labels; 3],
        edges: &Edges<S>,
        best: &mut Bytes<S>,
    ) -> Bytes<S> {
        let from = self.list.labels[entries.start];
        let decided = if ODD { 0..3 } else { 2..3 };
        let mut there = [Bytes::splat(simd, 0); 3];
        for side in decided.clone() {
            there[side] = edges.positions::<LEVELS>(simd, side, known[side], from);
        }
        let len = entries.len();
        let (labels, costs) = (&self.list.labels[entries.clone()], &self.costs[entries.clone()]);
        let (same, next) = (&self.same[entries.clone()], &self.next[entries.clone()]);
        let below = &self.below[entries][..len];
        let mut nearest = Bytes::splat(simd, 0);
        for i in 0..len {
            let label = labels[i] - from;
            let mut sum = below[i].load(simd);
            if !ODD {
                let next: Bytes<S> =
                    if self.plane == 0 { next[i].load::<S, -1>(simd) } else { next[i].load::<S, 0>(simd) };
                sum = sum + same[i].load(simd) + next;
            }
            for side in decided.clone() {
                let here = of_edges::<S, LEVELS>(simd, edges.levels[side], edges.position(label));
                let distance = here.saturating_sub(there[side]) | there[side].saturating_sub(here);
                sum += distance.min(edges.truncations[side]);
            }
            // The sum of four messages or smoothness costs is at most 4K, so only this addition can saturate.
            let belief = costs[i].load(simd).saturating_add(sum);
            nearest = belief.simd_lt(*best).select(Bytes::splat(simd, label as u8), nearest);
            *best = best.min(belief);
        }
        nearest
    }
}

/// The edges of a block's nodes to the neighbours that have labels.
///
/// What the smoothness costs is the distance of two *positions*, at most the truncation. The position of the first label of a
/// chunk is [`Self::first`], and that of a label d further is d steps of the edge's level further, in 8 bits. Neighbours' labels lie
/// anywhere. Clamped, they are still a truncation away from all labels of the chunk.
struct Edges<S: Simd> {
    levels: [Bytes<S>; 3],
    /// 0 where there is no neighbour.
    truncations: [Bytes<S>; 3],
    /// The step of each level.
    steps: [u8; EdgeLevels::COUNT],
    /// The largest truncation.
    first: u8,
    /// How far the labels of a chunk may be apart.
    reach: u16,
}

impl<S: Simd> Edges<S> {
    #[inline(always)]
    fn new<const LEVELS: bool>(simd: S, nodes: &Undecided<'_>) -> Self {
        let levels = levels(simd, nodes.greys.filter(|_| LEVELS), nodes.lane, [0, 1, 2]);
        let smoothness = nodes.model.edges().smoothness();
        let mut truncations = of_sides::<S, LEVELS>(simd, levels, smoothness.map(|edge| edge.truncation));
        for (truncation, mask) in truncations.iter_mut().zip(nodes.masks) {
            *truncation &= Bytes::from_slice(simd, &mask[nodes.lane..nodes.lane + LANES]);
        }
        let (first, steps) = (nodes.model.truncation(), smoothness.map(|edge| edge.step()));
        let reach = u16::from((u8::MAX - 2 * first) / steps[0].max(1));
        Self { levels, truncations, steps, first, reach }
    }

    /// The position of a label of a chunk, counted from the first one, by level.
    #[inline(always)]
    fn position(&self, label: u16) -> [u8; EdgeLevels::COUNT] {
        // No product exceeds 8 bits, so this multiplies all of them.
        let first = u32::from_ne_bytes([self.first; EdgeLevels::COUNT]);
        (u32::from_ne_bytes(self.steps) * u32::from(label) + first).to_ne_bytes()
    }

    /// The positions of neighbours' labels.
    #[inline(always)]
    fn positions<const LEVELS: bool>(&self, simd: S, side: usize, labels: &Labels, from: u16) -> Bytes<S> {
        /// Labels that lie farther below cost the truncation, unless a step costs nothing.
        const BELOW: u16 = MAX_TRUNCATION as u16;
        let steps: [u8; LANES] = of_edges::<S, LEVELS>(simd, self.levels[side], self.steps).into();
        let mut positions = [0; LANES];
        for ((position, &label), step) in positions.iter_mut().zip(labels).zip(steps) {
            let step = u16::from(step);
            let above = (label + BELOW).saturating_sub(from).min(BELOW + u16::from(u8::MAX));
            let position_above = step * above + u16::from(self.first);
            *position = position_above.saturating_sub(step * BELOW).min(u8::MAX.into()) as u8;
        }
        Bytes::load_array(simd, positions)
    }
}
