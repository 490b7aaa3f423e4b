//! Data costs of blocks, summed over the pixels that a node covers: one on grid 0, up to four on grid 1, up to 16 on grid 2.
//!
//! In the terms of `bp-cpu-scalar`, the kernel computes for every node and each label d of its list:
//!
//! ```text
//! raw(d) = sum over its pixels (x, y) of D(left(x, y), right(x - disparity(d), y)), or the out-of-range cost
//! least = min over d of raw(d)
//! ```
//!
//! Lane i of the image's two planes is lane i of a row of grid 1, in the order of columns. So sums over planes and rows stay in
//! their lanes, and are dealt to the planes of the coarser grid at the end.

use std::{array, ops::Range};

use fearless_simd::{Simd, SimdBase, SimdSplit, dispatch, u8x64};

use super::Matching;
use crate::{
    block::{Block, Bytes, LANES},
    compare::{Vector, compare_by},
    shape::WIDEST,
};

/// The nodes of both planes of a patch in row y of a grid.
#[derive(Clone, Copy)]
pub(crate) struct PatchRow {
    pub(crate) grid: usize,
    pub(crate) patch: usize,
    pub(crate) y: usize,
}

/// Costs to be written, `[plane][entry]`, for these labels. Those of several rows of pixels are added.
struct To<'a> {
    labels: &'a [u16],
    costs: [&'a mut [Block]; 2],
}

impl Matching<'_> {
    /// Writes the unclipped costs of these nodes of grid 0, 1 or 2 for these labels, `[plane][entry]`, and returns the least of
    /// each node. They must fit 8 bits.
    pub(crate) fn unclipped(&self, at: PatchRow, labels: &[u16], [even, odd]: [&mut [Block]; 2]) -> [Block; 2] {
        let PatchRow { grid, patch, y } = at;
        let y = y << grid;
        let level = self.level;
        let to = To { labels, costs: [&mut *even, &mut *odd] };
        match (grid, self.layout.size.height - y) {
            (0, _) => return dispatch!(level, simd => self.pixels(simd, patch, y, to)),
            (1, 2..) => return dispatch!(level, simd => self.squares(simd, Footprint::<1, 2>, patch, y, to)),
            (2, 4..) => return dispatch!(level, simd => self.squares(simd, Footprint::<2, 4>, patch, y, to)),
            _ => {}
        }
        // At the lower border, row by row.
        let mut least = [Block::ZERO; 2];
        to.costs.into_iter().for_each(|costs| costs.fill(Block::ZERO));
        for y in y..self.layout.size.height {
            let to = To { labels, costs: [&mut *even, &mut *odd] };
            least = match grid {
                1 => dispatch!(level, simd => self.squares(simd, Footprint::<1, 1>, patch, y, to)),
                _ => dispatch!(level, simd => self.squares(simd, Footprint::<2, 1>, patch, y, to)),
            };
        }
        least
    }

    #[inline(always)]
    fn pixels<S: Simd>(&self, simd: S, patch: usize, y: usize, to: To<'_>) -> [Block; 2] {
        compare_by!(self.plan.model().profile(), Bytes<S>, self.pixels_by(simd, patch, y, to))
    }

    #[inline(always)]
    fn pixels_by<S: Simd, const CHANNELS: usize>(
        &self,
        simd: S,
        patch: usize,
        y: usize,
        to: To<'_>,
        cost: impl Fn([Bytes<S>; CHANNELS], [Bytes<S>; CHANNELS]) -> Bytes<S>,
    ) -> [Block; 2] {
        let rows = Rows::<S, Bytes<S>, CHANNELS, 1>::new(simd, self, y);
        let first = LANES * patch;
        let lanes = self.lanes(&rows, y, first);
        run(simd, &Pixels { rows: &rows, lanes: &lanes, cost }, first..first + LANES, self, to)
    }

    #[inline(always)]
    fn squares<S: Simd, const SPANS: usize, const ROWS: usize>(
        &self,
        simd: S,
        footprint: Footprint<SPANS, ROWS>,
        patch: usize,
        y: usize,
        to: To<'_>,
    ) -> [Block; 2] {
        compare_by!(self.plan.model().profile(), u8x64<S>, self.squares_by(simd, footprint, patch, y, to))
    }

    #[inline(always)]
    fn squares_by<S: Simd, const SPANS: usize, const ROWS: usize, const CHANNELS: usize>(
        &self,
        simd: S,
        _: Footprint<SPANS, ROWS>,
        patch: usize,
        y: usize,
        to: To<'_>,
        cost: impl Fn([u8x64<S>; CHANNELS], [u8x64<S>; CHANNELS]) -> u8x64<S>,
    ) -> [Block; 2] {
        let rows = Rows::<S, u8x64<S>, CHANNELS, ROWS>::new(simd, self, y);
        let first = SPANS * WIDEST * patch;
        let spans: [_; SPANS] = array::from_fn(
            #[inline(always)]
            |span| self.lanes(&rows, y, first + span * WIDEST),
        );
        run(simd, &Squares { rows: &rows, spans: &spans, cost }, first..first + SPANS * WIDEST, self, to)
    }

    /// Loads the lanes of the left image from `first` on. Those beyond the image count as zeros. A row may lack a second span;
    /// then this loads the first one again.
    #[inline(always)]
    fn lanes<S: Simd, V: Vector<S>, const CHANNELS: usize, const ROWS: usize>(
        &self,
        rows: &Rows<'_, S, V, CHANNELS, ROWS>,
        y: usize,
        first: usize,
    ) -> Lanes<V, CHANNELS, ROWS> {
        let exists = first < self.layout.lanes();
        let first = if exists { first } else { first - WIDEST };
        let left =
            |row: usize, parity: usize| channels::<CHANNELS>(|channel| self.features.left(y + row, channel, parity));
        let none = V::splat(rows.simd, 0);
        let mut lanes = Lanes { first: first as i32, left: [[[none; CHANNELS]; ROWS]; 2], exist: [none; 2] };
        // Loops are inlined where `map` is not.
        for plane in 0..2 {
            let (parity, moved) = self.own(plane);
            for row in 0..ROWS {
                for (lanes, left) in lanes.left[plane][row].iter_mut().zip(left(row, parity)) {
                    *lanes = rows.load(left, first + moved);
                }
            }
            if exists {
                lanes.exist[plane] = rows.load(self.features.inside(parity), WIDEST + first + moved);
            }
        }
        lanes
    }
}

/// Calls `lanes` for every channel and collects the results.
#[inline(always)]
fn channels<'a, const CHANNELS: usize>(lanes: impl Fn(usize) -> &'a [u8]) -> [&'a [u8]; CHANNELS] {
    let mut all = [[].as_slice(); CHANNELS];
    all.iter_mut().enumerate().for_each(|(channel, of)| *of = lanes(channel));
    all
}

/// The pixels that the nodes of a patch cover: `SPANS` vectors of lanes of both planes, in `ROWS` rows.
struct Footprint<const SPANS: usize, const ROWS: usize>;

/// Rows of the right image.
struct Rows<'a, S: Simd, V: Vector<S>, const CHANNELS: usize, const ROWS: usize> {
    simd: S,
    /// By parity of the column; see [`crate::features::Features::right`].
    right: [[[&'a [u8]; CHANNELS]; ROWS]; 2],
    inside: [&'a [u8]; 2],
    /// The number of columns of each parity.
    columns: [i32; 2],
    /// Columns of the pair before the first node.
    margin: i32,
    /// The costs of a column's pixels whose matches lie outside the image.
    outside: V,
}

/// The lanes of the left image that a vector holds, in the same rows.
struct Lanes<V, const CHANNELS: usize, const ROWS: usize> {
    first: i32,
    /// By plane.
    left: [[[V; CHANNELS]; ROWS]; 2],
    /// By plane, 255 where the image has a column, otherwise 0.
    exist: [V; 2],
}

impl<'a, S: Simd, V: Vector<S>, const CHANNELS: usize, const ROWS: usize> Rows<'a, S, V, CHANNELS, ROWS> {
    #[inline(always)]
    fn new(simd: S, matching: &'a Matching<'_>, y: usize) -> Self {
        let Matching { features, plan, .. } = matching;
        let (width, margin) = (plan.pair_size().width as i32, plan.margin() as i32);
        let right = |row: usize, parity: usize| channels(|channel| features.right(y + row, channel, parity));
        Self {
            simd,
            right: [0, 1].map(|parity| array::from_fn(|row| right(row, parity))),
            inside: [0, 1].map(|parity| features.inside(parity)),
            columns: [(width + 1) / 2, width / 2],
            margin,
            outside: V::splat(simd, ROWS as u8 * plan.model().profile().out_of_range_cost() as u8),
        }
    }

    #[inline(always)]
    fn load(&self, values: &[u8], at: usize) -> V {
        V::from_slice(self.simd, &values[at..at + V::LEN])
    }

    /// The costs of the pixels of a plane at this disparity, summed over the rows. If `INSIDE`, none is matched with a pixel
    /// outside the image.
    #[inline(always)]
    fn costs<const INSIDE: bool>(
        &self,
        lanes: &Lanes<V, CHANNELS, ROWS>,
        plane: usize,
        disparity: i32,
        cost: &impl Fn([V; CHANNELS], [V; CHANNELS]) -> V,
    ) -> V {
        // Left column 2i + p, with p = plane + margin, matches right column 2i + p - d, which is lane i + (p - d) div 2.
        let shift = plane as i32 + self.margin - disparity;
        let (parity, start) = ((shift & 1) as usize, lanes.first + (shift >> 1));
        let start = if INSIDE { start } else { start.clamp(-(WIDEST as i32), self.columns[parity]) };
        let start = (start + WIDEST as i32) as usize;
        let mut sum = V::splat(self.simd, 0);
        for row in 0..ROWS {
            let right = self.right[parity][row].map(
                #[inline(always)]
                |right| self.load(right, start),
            );
            sum += cost(lanes.left[plane][row], right);
        }
        if !INSIDE {
            let inside = self.load(self.inside[parity], start);
            sum = sum & inside | self.outside & !inside;
        }
        sum & lanes.exist[plane]
    }
}

/// Something that computes the costs of both planes of a patch for a label.
trait Costs<S: Simd> {
    /// `held` are the costs so far.
    fn costs<const INSIDE: bool>(&self, disparity: i32, held: [&Block; 2]) -> [Bytes<S>; 2];
}

/// Nodes of grid 0.
struct Pixels<'a, S: Simd, const CHANNELS: usize, F> {
    rows: &'a Rows<'a, S, Bytes<S>, CHANNELS, 1>,
    lanes: &'a Lanes<Bytes<S>, CHANNELS, 1>,
    cost: F,
}

impl<S: Simd, const CHANNELS: usize, F> Costs<S> for Pixels<'_, S, CHANNELS, F>
where
    F: Fn([Bytes<S>; CHANNELS], [Bytes<S>; CHANNELS]) -> Bytes<S>,
{
    #[inline(always)]
    fn costs<const INSIDE: bool>(&self, disparity: i32, _: [&Block; 2]) -> [Bytes<S>; 2] {
        [0, 1].map(
            #[inline(always)]
            |plane| self.rows.costs::<INSIDE>(self.lanes, plane, disparity, &self.cost),
        )
    }
}

/// Nodes of grid 1, which cover one span of lanes, or of grid 2, which cover two.
struct Squares<'a, S: Simd, const SPANS: usize, const ROWS: usize, const CHANNELS: usize, F> {
    rows: &'a Rows<'a, S, u8x64<S>, CHANNELS, ROWS>,
    spans: &'a [Lanes<u8x64<S>, CHANNELS, ROWS>; SPANS],
    cost: F,
}

impl<S: Simd, const SPANS: usize, const ROWS: usize, const CHANNELS: usize, F> Costs<S>
    for Squares<'_, S, SPANS, ROWS, CHANNELS, F>
where
    F: Fn([u8x64<S>; CHANNELS], [u8x64<S>; CHANNELS]) -> u8x64<S>,
{
    #[inline(always)]
    fn costs<const INSIDE: bool>(&self, disparity: i32, held: [&Block; 2]) -> [Bytes<S>; 2] {
        let simd = self.rows.simd;
        let mut sums = [u8x64::splat(simd, 0); 2];
        for (span, sum) in self.spans.iter().zip(&mut sums) {
            let of_plane = [0, 1].map(
                #[inline(always)]
                |plane| self.rows.costs::<INSIDE>(span, plane, disparity, &self.cost),
            );
            *sum = of_plane[0] + of_plane[1];
        }
        let mut sum = sums[0];
        if SPANS == 2 {
            let (even, odd) = sum.deinterleave(sums[1]);
            sum = even + odd;
        }
        let (first, second) = sum.split();
        let (even, odd) = first.deinterleave(second);
        if ROWS == 1 { [held[0].load(simd) + even, held[1].load(simd) + odd] } else { [even, odd] }
    }
}

/// Writes the costs for all labels and returns the least of each node. `lanes` are those of the pixels.
#[inline(always)]
fn run<S: Simd>(
    simd: S,
    nodes: &impl Costs<S>,
    lanes: Range<usize>,
    matching: &Matching<'_>,
    to: To<'_>,
) -> [Block; 2] {
    let To { labels, costs: [even, odd] } = to;
    let inside = inside(matching, lanes, labels);
    let mut least = [Bytes::<S>::splat(simd, u8::MAX); 2];
    for (i, ((&label, even), odd)) in labels.iter().zip(even).zip(odd).enumerate() {
        let disparity = matching.plan.model().min_disparity() + i32::from(label);
        let held = [&*even, &*odd];
        let costs = if inside.contains(&i) {
            nodes.costs::<true>(disparity, held)
        } else {
            nodes.costs::<false>(disparity, held)
        };
        even.store(costs[0]);
        odd.store(costs[1]);
        least = [least[0].min(costs[0]), least[1].min(costs[1])];
    }
    least.map(|least| Block(least.into()))
}

/// The labels, which ascend, under which all pixels in these lanes are matched with pixels of the image.
fn inside(matching: &Matching<'_>, lanes: Range<usize>, labels: &[u16]) -> Range<usize> {
    let Matching { plan, .. } = matching;
    let width = plan.pair_size().width as i32;
    let [first, end] = [lanes.start, lanes.end].map(|lane| (2 * lane + plan.margin()) as i32);
    let disparity = |label: u16| plan.model().min_disparity() + i32::from(label);
    let start = labels.partition_point(|&label| disparity(label) < end.min(width) - width);
    start..labels.partition_point(|&label| disparity(label) <= first).max(start)
}
