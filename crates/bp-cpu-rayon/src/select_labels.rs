//! Labels: those of least belief, or in sequence, given the labels already decided.

use bp_core::{BAND_ROWS, Model, Side};
use fearless_simd::{Select, Simd, SimdBase, SimdInt, dispatch};
use rayon::prelude::*;

use crate::{
    layout::{BLOCK, Layout},
    match_cost::block,
    refine::slot,
    solver::Answer,
};

/// Labels that are compared at a time: as many as let the distances to decided labels, which count up to
/// [`FAR`] only, stay within 8 bits.
const CHUNK: usize = 128;

/// A distance of labels that costs the truncation whatever the slope is, unless that is 0.
const FAR: usize = 64;

/// Writes the smallest label of least belief of every node, `[height][width]`.
pub(crate) fn select_labels(answer: &Answer<'_>, labels: &mut [u16]) {
    labels.par_chunks_exact_mut(answer.layout.size.width).enumerate().for_each(|(y, row)| {
        for plane in 0..2 {
            let received = Side::ALL.map(|side| answer.received((plane, y), side));
            answer.decide((plane, y), received, None, false, row);
        }
    });
}

/// Decodes after sweeps: bands of odd index first, rows from top to bottom, even nodes before odd ones.
pub(crate) fn decode(answer: &Answer<'_>, labels: &mut [u16]) {
    let (width, height) = (answer.layout.size.width, answer.layout.size.height);
    let band = BAND_ROWS * width;
    if let Some(rows) = labels.get_mut(band..) {
        let bands = rows.par_chunks_mut(2 * band).enumerate();
        bands.for_each(|(index, rows)| answer.decode_band((2 * index + 1) * BAND_ROWS, None, rows));
    }
    // A band of even index also reads the row above it.
    let (first, others) = labels.split_at_mut((2 * BAND_ROWS - 1).min(height) * width);
    let decode_others = || {
        others.par_chunks_mut(2 * band).enumerate().for_each(|(index, rows)| {
            let (above, rows) = rows.split_at_mut(width);
            answer.decode_band(2 * (index + 1) * BAND_ROWS, Some(above), rows);
        });
    };
    rayon::join(|| answer.decode_band(0, None, first), decode_others);
}

/// What one node received, `[label][lane]`, and where there is a node that sent it, `[lane]`.
type Received<'a> = (&'a [u8], Option<&'a [u8]>);

impl<'a> Answer<'a> {
    fn received(&self, (plane, y): (usize, usize), side: Side) -> Option<Received<'a>> {
        let values = self.received[(plane + y) % 2].towards(side, plane, y)?;
        Some((values, self.mask(plane, side)))
    }

    /// Where the nodes of `plane` have a neighbour on `side`, `[lane]`; of up and down the rows know.
    fn mask(&self, plane: usize, side: Side) -> Option<&'a [u8]> {
        self.layout.masks(plane).get(slot(side, plane)).copied()
    }

    /// Decodes the band that starts at row `first`; `rows` may go on after it.
    fn decode_band(&self, first: usize, above: Option<&[u16]>, rows: &mut [u16]) {
        let mut above = above;
        for (row, y) in rows.chunks_exact_mut(self.layout.size.width).zip(first..first + BAND_ROWS) {
            let (even, odd) = (y % 2, 1 - y % 2);
            let up = above.filter(|_| self.layout.joined_above(y));
            let [left, right, _, down] = Side::ALL.map(|side| self.received((even, y), side));
            self.decide((even, y), [left, right, None, down], up, false, row);
            let down = self.received((odd, y), Side::Down);
            self.decide((odd, y), [None, None, None, down], up, true, row);
            above = Some(row);
        }
    }

    /// Decides the nodes of `plane` in row `y`: the smallest label that costs least with what was received from
    /// sides, with the labels of the row above, and, where `beside`, with those of the other nodes of the row.
    fn decide(
        &self,
        (plane, y): (usize, usize),
        received: [Option<Received<'_>>; 4],
        above: Option<&[u16]>,
        beside: bool,
        row: &mut [u16],
    ) {
        let nodes = Nodes { layout: self.layout, model: self.model, costs: self.costs(plane, y), received };
        for at in (0..self.layout.nodes(plane)).step_by(BLOCK) {
            let up = above.map(|above| decided(above, 2 * at as isize + plane as isize));
            let sides = [Side::Left, Side::Right].map(|side| {
                let dx = if side == Side::Left { -1 } else { 1 };
                let labels = || decided(row, 2 * at as isize + plane as isize + dx);
                beside.then(|| (labels(), self.mask(plane, side).map(|mask| *block(mask, at))))
            });
            let [left, right] = sides;
            let known = [left, right, up.map(|labels| (labels, None))];
            let labels = dispatch!(self.level, simd => nodes.block(simd, at, &known));
            let columns = row.iter_mut().skip(2 * at + plane).step_by(2);
            columns.zip(labels).for_each(|(out, label)| *out = label);
        }
    }
}

/// Labels of every second column from `x` on; 0 outside.
fn decided(row: &[u16], x: isize) -> [u16; BLOCK] {
    match usize::try_from(x).ok().and_then(|x| row.get(x..x + 2 * BLOCK)) {
        Some(row) => std::array::from_fn(|lane| row[2 * lane]),
        None => std::array::from_fn(|lane| {
            let x = usize::try_from(x + 2 * lane as isize).ok();
            x.and_then(|x| row.get(x)).copied().unwrap_or(0)
        }),
    }
}

/// Decided labels of neighbours of a block of nodes, and where there are any.
type Known = ([u16; BLOCK], Option<[u8; BLOCK]>);

/// The nodes of one plane in one row.
struct Nodes<'a> {
    layout: &'a Layout,
    model: &'a Model,
    costs: &'a [u8],
    received: [Option<Received<'a>>; 4],
}

impl Nodes<'_> {
    #[inline(always)]
    fn block<S: Simd>(&self, simd: S, at: usize, known: &[Option<Known>; 3]) -> [u16; BLOCK] {
        simd.vectorize(
            #[inline(always)]
            || {
                let mut labels = [0; BLOCK];
                for lane in (0..BLOCK).step_by(S::u8s::LEN) {
                    self.vector(simd, at, lane, known, &mut labels[lane..lane + S::u8s::LEN]);
                }
                labels
            },
        )
    }

    /// Decides one vector of nodes: chunk by chunk of labels, since a label's index has 8 bits.
    #[inline(always)]
    fn vector<S: Simd>(&self, simd: S, at: usize, lane: usize, known: &[Option<Known>; 3], out: &mut [u16]) {
        let zero = S::u8s::splat(simd, 0);
        let mut received: [(&[u8], S::u8s); 4] = [(&[], zero); 4];
        let mut sides = 0;
        for (values, mask) in self.received.iter().flatten() {
            received[sides] = (&values[at + lane..], vector_of(simd, mask.map(|mask| &mask[at + lane..])));
            sides += 1;
        }
        let mut best = S::u8s::splat(simd, u8::MAX);
        for from in (0..self.layout.labels).step_by(CHUNK) {
            let mut near = [(zero, zero); 3];
            let mut decided = 0;
            for (labels, mask) in known.iter().flatten() {
                let mask = vector_of(simd, mask.as_ref().map(|mask| &mask[lane..]));
                near[decided] = (relative(simd, &labels[lane..], from), mask);
                decided += 1;
            }
            let before = best;
            let mut index = zero;
            for label in from..(from + CHUNK).min(self.layout.labels) {
                let start = label * self.layout.lanes;
                let mut sum = zero;
                for &(values, mask) in &received[..sides] {
                    sum += S::u8s::from_slice(simd, &values[start..start + S::u8s::LEN]) & mask;
                }
                let here = S::u8s::splat(simd, (label - from + FAR) as u8);
                for &(label, mask) in &near[..decided] {
                    let distance = here.saturating_sub(label) | label.saturating_sub(here);
                    sum += smoothness::<S>(simd, self.model, distance) & mask;
                }
                let start = start + at + lane;
                // What is added to the data cost is at most 4K.
                let belief = S::u8s::from_slice(simd, &self.costs[start..start + S::u8s::LEN]).saturating_add(sum);
                index = belief.simd_lt(best).select(S::u8s::splat(simd, (label - from) as u8), index);
                best = belief.min(best);
            }
            let lower = best.simd_lt(before).select(S::u8s::splat(simd, u8::MAX), zero);
            for ((out, &index), &lower) in out.iter_mut().zip(index.as_slice()).zip(lower.as_slice()) {
                *out = if lower > 0 { from as u16 + u16::from(index) } else { *out };
            }
        }
    }
}

/// A vector of a mask; all ones without one.
#[inline(always)]
fn vector_of<S: Simd>(simd: S, mask: Option<&[u8]>) -> S::u8s {
    match mask {
        Some(mask) => S::u8s::from_slice(simd, &mask[..S::u8s::LEN]),
        None => S::u8s::splat(simd, u8::MAX),
    }
}

/// Labels relative to a chunk of labels, clamped to where distances count.
#[inline(always)]
fn relative<S: Simd>(simd: S, labels: &[u16], from: usize) -> S::u8s {
    let mut relative = [0; BLOCK];
    for (relative, &label) in relative.iter_mut().zip(labels) {
        *relative = (label + FAR as u16).saturating_sub(from as u16).min(255) as u8;
    }
    S::u8s::from_slice(simd, &relative[..S::u8s::LEN])
}

/// The smoothness cost of distances between labels; the product fits, since distances beyond K div s count as that plus 1.
#[inline(always)]
fn smoothness<S: Simd>(simd: S, model: &Model, distance: S::u8s) -> S::u8s {
    let (step, truncation) = (model.step(), model.truncation());
    let far = truncation.checked_div(step).map_or(0, |far| far + 1);
    (distance.min(S::u8s::splat(simd, far)) * S::u8s::splat(simd, step)).min(S::u8s::splat(simd, truncation))
}
