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

use std::ops::Range;

use bp_core::{MAX_TRUNCATION, Model, Smoothness};
use fearless_simd::{Select, Simd, SimdBase, SimdInt, dispatch};

use super::{
    edges::{levels, of_sides},
    lists::List,
    messages::Place,
    padded::Padded,
    pass::Pass,
};
use crate::{
    block::{Block, Bytes, LANES},
    greys::Around,
};

/// A distance of labels that costs the truncation for every slope but 0.
const FAR: usize = MAX_TRUNCATION as usize + 1;

/// The labels compared at a time span less than this. Decided labels are clamped to [`FAR`] beyond either end of such a chunk,
/// so distances to them stay within 8 bits.
const CHUNK: usize = 256 - 2 * FAR;

/// The labels of the nodes of a block.
type Labels = [u16; LANES];

impl Pass<'_> {
    /// Decides the labels of these rows, `[row][width]`, given those of the row above, if there are any.
    pub(crate) fn decode(&self, rows: Range<usize>, above: Option<&[u16]>, labels: &mut [u16]) {
        let level = self.sweep.level;
        let mut above = above;
        for (row, y) in labels.chunks_exact_mut(self.sweep.layout.size.width).zip(rows) {
            let joined = above.filter(|_| self.sweep.layout.joined_above(y));
            dispatch!(level, simd => self.decode_row(simd, y, joined, row));
            above = Some(row);
        }
    }

    #[inline(always)]
    fn decode_row<S: Simd>(&self, simd: S, y: usize, above: Option<&[u16]>, row: &mut [u16]) {
        let patches = 0..self.lists.patches();
        for patch in patches.clone() {
            write(row, patch, self.decide::<_, false>(simd, patch, y, above, row));
        }
        // Written one patch late: the next one reads a column of this one, and would wait for it.
        let mut late = None;
        for patch in patches {
            let planes = self.decide::<_, true>(simd, patch, y, above, row);
            if let Some((patch, planes)) = late.replace((patch, planes)) {
                write(row, patch, planes);
            }
        }
        if let Some((patch, planes)) = late {
            write(row, patch, planes);
        }
    }

    /// Decides the labels of the even or the odd nodes of a patch. Even nodes come first.
    #[inline(always)]
    fn decide<S: Simd, const ODD: bool>(
        &self,
        simd: S,
        patch: usize,
        y: usize,
        above: Option<&[u16]>,
        row: &[u16],
    ) -> [Labels; 2] {
        let plane = if ODD { 1 - y % 2 } else { y % 2 };
        let (entries, range) = (self.lists.entries(), self.lists.range(patch));
        let place = Place { entries, row: y - self.rows.start, plane, range: &range };
        let messages = self.messages.at(&place);
        let first = (2 * LANES * patch + plane) as isize;
        let [left, right] = if ODD { [first - 1, first + 1].map(|x| every_second(row, x)) } else { [[0; LANES]; 2] };
        // By slot: the neighbour in the same pair of columns, that in the next pair, and that above.
        let [same, next] = if plane == 0 { [right, left] } else { [left, right] };
        let known = [same, next, every_second(above.unwrap_or_default(), first)];
        let undecided = Undecided {
            plane,
            list: self.lists.list(patch),
            costs: self.work.costs(self.sweep, patch, y, &place),
            same: messages.same,
            next: messages.next,
            below: messages.below,
            model: self.sweep.plan.model(),
            lane: LANES * patch,
            masks: self.masks(plane, above.is_some()),
            greys: self.sweep.layout.around(plane, y),
        };
        let labels = if undecided.greys.is_some() {
            undecided.decide::<_, ODD, true>(simd, &known)
        } else {
            undecided.decide::<_, ODD, false>(simd, &known)
        };
        if plane == 0 { [labels, same] } else { [same, labels] }
    }

    /// By slot, 255 where a node has a neighbour, `[lane]`.
    fn masks(&self, plane: usize, has_above: bool) -> [&[u8]; 3] {
        let [same, next] = self.sweep.layout.masks(plane);
        [same, next, self.sweep.layout.none_and_all()[usize::from(has_above)]]
    }
}

/// The labels of every second column from x on; 0 outside the image.
#[inline(always)]
fn every_second(row: &[u16], x: isize) -> Labels {
    let mut labels = [0; LANES];
    let inside = usize::try_from(x).ok().and_then(|x| row.get(x..)?.first_chunk::<{ 2 * LANES - 1 }>());
    // A known number of columns is dealt by vectors.
    if let Some(columns) = inside {
        labels.iter_mut().enumerate().for_each(|(lane, label)| *label = columns[2 * lane]);
        return labels;
    }
    let first = usize::from(x < 0);
    let columns = row.get((x + 2 * first as isize) as usize..).unwrap_or_default();
    labels[first..].iter_mut().zip(columns.iter().step_by(2)).for_each(|(label, &decided)| *label = decided);
    labels
}

/// Writes the labels of both planes of a patch, as far as there are columns.
#[inline(always)]
fn write(row: &mut [u16], patch: usize, planes: [Labels; 2]) {
    let columns = &mut row[2 * LANES * patch..];
    let mut labels = [0; 2 * LANES];
    for (pair, (even, odd)) in labels.chunks_exact_mut(2).zip(planes[0].iter().zip(&planes[1])) {
        (pair[0], pair[1]) = (*even, *odd);
    }
    match columns.first_chunk_mut() {
        Some(columns) => *columns = labels,
        None => columns.copy_from_slice(&labels[..columns.len()]),
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
    fn decide<S: Simd, const ODD: bool, const LEVELS: bool>(&self, simd: S, known: &[Labels; 3]) -> Labels {
        let mut labels = [0; LANES];
        let mut best = Bytes::<S>::splat(simd, u8::MAX);
        let mut entry = 0;
        while entry < self.list.labels.len() {
            let from = usize::from(self.list.labels[entry]);
            let end = self.chunk_end(entry);
            let before = best;
            let nearest = self.chunk::<S, ODD, LEVELS>(simd, entry..end, known, &mut best);
            let better = best.simd_lt(before).select(Bytes::splat(simd, 1), Bytes::splat(simd, 0));
            let (better, nearest): ([u8; LANES], [u8; LANES]) = (better.into(), nearest.into());
            for ((label, better), nearest) in labels.iter_mut().zip(better).zip(nearest) {
                let decided = (from as u16 + u16::from(nearest)).wrapping_sub(FAR as u16);
                *label = if better > 0 { decided } else { *label };
            }
            entry = end;
        }
        labels
    }

    /// The end of the chunk that begins with an entry.
    #[inline(always)]
    fn chunk_end(&self, entry: usize) -> usize {
        let labels = &self.list.labels[entry..];
        let inside = |label: u16| label - labels[0] < CHUNK as u16;
        // Mostly all of them.
        let all = labels.last().is_none_or(|&last| inside(last));
        entry + if all { labels.len() } else { labels.partition_point(|&label| inside(label)) }
    }

    /// Compares these entries with the best so far, and returns for each node the label of the best of them, counted from [`FAR`]
    /// below the first.
    #[inline(always)]
    fn chunk<S: Simd, const ODD: bool, const LEVELS: bool>(
        &self,
        simd: S,
        entries: Range<usize>,
        known: &[Labels; 3],
        best: &mut Bytes<S>,
    ) -> Bytes<S> {
        let from = usize::from(self.list.labels[entries.start]);
        let decided = if ODD { 0..3 } else { 2..3 };
        let near = known.each_ref().map(|labels| near(simd, labels, from));
        let smoothness = Edges::<S>::new::<LEVELS>(simd, self);
        let len = entries.len();
        let (labels, costs) = (&self.list.labels[entries.clone()], &self.costs[entries.clone()]);
        let (same, next) = (&self.same[entries.clone()], &self.next[entries.clone()]);
        let below = &self.below[entries][..len];
        let mut nearest = Bytes::splat(simd, 0);
        for i in 0..len {
            let here = Bytes::splat(simd, (usize::from(labels[i]) - from + FAR) as u8);
            let mut sum = below[i].load(simd);
            if !ODD {
                let next: Bytes<S> =
                    if self.plane == 0 { next[i].load::<S, -1>(simd) } else { next[i].load::<S, 0>(simd) };
                sum = sum + same[i].load(simd) + next;
            }
            for side in decided.clone() {
                let distance = here.saturating_sub(near[side]) | near[side].saturating_sub(here);
                sum += smoothness.of(side, distance);
            }
            // The sum of four messages or smoothness costs is at most 4K, so only this addition can saturate.
            let belief = costs[i].load(simd).saturating_add(sum);
            nearest = belief.simd_lt(*best).select(here, nearest);
            *best = best.min(belief);
        }
        nearest
    }
}

/// The smoothness costs of the edges of a block's nodes to the neighbours that have labels; 0 where there is no neighbour.
struct Edges<S: Simd> {
    /// The distance from which on an edge costs its truncation.
    far: [Bytes<S>; 3],
    steps: [Bytes<S>; 3],
    truncations: [Bytes<S>; 3],
}

impl<S: Simd> Edges<S> {
    #[inline(always)]
    fn new<const LEVELS: bool>(simd: S, nodes: &Undecided<'_>) -> Self {
        let levels = levels(simd, nodes.greys.filter(|_| LEVELS), nodes.lane, [0, 1, 2]);
        let edges = nodes.model.edges().smoothness();
        let mut truncations = of_sides::<S, LEVELS>(simd, levels, edges.map(|edge| edge.truncation));
        for (truncation, mask) in truncations.iter_mut().zip(nodes.masks) {
            *truncation &= Bytes::from_slice(simd, &mask[nodes.lane..nodes.lane + LANES]);
        }
        let far = |edge: Smoothness| edge.truncation.checked_div(edge.step()).map_or(0, |far| far + 1);
        Self {
            far: of_sides::<S, LEVELS>(simd, levels, edges.map(far)),
            steps: of_sides::<S, LEVELS>(simd, levels, edges.map(Smoothness::step)),
            truncations,
        }
    }

    /// The product of [`Self::far`] with a step is at most the truncation and a step, which fits 8 bits.
    #[inline(always)]
    fn of(&self, side: usize, distance: Bytes<S>) -> Bytes<S> {
        (distance.min(self.far[side]) * self.steps[side]).min(self.truncations[side])
    }
}

/// Decided labels relative to a chunk of labels, clamped to [`FAR`] beyond its ends.
#[inline(always)]
fn near<S: Simd>(simd: S, labels: &Labels, from: usize) -> Bytes<S> {
    let relative = labels.map(
        #[inline(always)]
        |label| (label + FAR as u16).saturating_sub(from as u16).min(255) as u8,
    );
    Bytes::load_array(simd, relative)
}
