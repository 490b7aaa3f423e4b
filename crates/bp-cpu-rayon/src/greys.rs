//! The grey values of a grid. They determine the levels of edges; see [`bp_core::EdgeLevels`].

use bp_core::{EdgeLevels, Error, Image, Model, Plan, memory::Buffer};
use fearless_simd::{Bytes, Level, Select, Simd, SimdBase, dispatch, u8x16, u32x4};
use rayon::prelude::*;

use crate::{
    compare::Vector,
    shape::{MIN_ROWS, Shape, WIDEST, deal},
};

/// Grey values `[height][plane][lane]`, with [`WIDEST`] lanes of padding on both sides of every row of lanes. Empty if all
/// edges have the same cost.
#[derive(Debug)]
pub(crate) struct Greys {
    shape: Shape,
    edges: EdgeLevels,
    values: Buffer<u8>,
}

impl Greys {
    /// Allocates room for the grey values of `grid`.
    pub(crate) fn new(plan: &Plan, grid: usize) -> Result<Self, Error> {
        let values = Buffer::filled("grey values", bytes(plan, grid) as usize, 0)?;
        Ok(Self { shape: Shape::new(plan, grid), edges: *plan.model().edges(), values })
    }

    /// Loads the grey values of an image from column `margin` on.
    pub(crate) fn load(&mut self, level: Level, image: &Image, margin: usize) {
        let shape = self.shape;
        let rows = self.values.par_chunks_exact_mut(2 * stride(&shape)).with_min_len(MIN_ROWS).enumerate();
        rows.for_each(|(y, row)| {
            let [even, odd] = planes_mut(&shape, row);
            let greys = &image.greys()[y * image.size().width + margin..][..shape.size.width];
            dispatch!(level, simd => load_row(simd, greys, even, odd));
        });
    }

    /// Computes the grey values of a coarser grid: a node has the mean of its children, at most four.
    pub(crate) fn coarsen(&mut self, level: Level, fine: &Self) {
        let shape = self.shape;
        let rows = self.values.par_chunks_exact_mut(2 * stride(&shape)).with_min_len(MIN_ROWS).enumerate();
        rows.for_each(|(y, row)| {
            // Coarse column X has lane X of both fine planes as children. Where there is no second row or column, the first one
            // counts twice.
            let rows = [2 * y, (2 * y + 1).min(fine.shape.size.height - 1)];
            let [[a, b], [c, d]] = rows.map(|y| [0, 1].map(|plane| fine.lanes(plane, y)));
            let [even, odd] = planes_mut(&shape, row);
            dispatch!(level, simd => simd.vectorize(
                #[inline(always)]
                || deal(simd, even, odd, |first, columns, means| {
                    let inside = first..first + columns;
                    let children = a[inside.clone()].iter().zip(&b[inside.clone()]).zip(c[inside.clone()].iter().zip(&d[inside]));
                    means.iter_mut().zip(children).for_each(|(mean, ((&a, &b), (&c, &d)))| *mean = mean_of([a, b, c, d]));
                }),
            ));
            if let Some(x) = fine.shape.size.width.checked_sub(1).filter(|x| x % 2 == 0).map(|x| x / 2) {
                [even, odd][x % 2][x / 2] = mean_of([a[x], a[x], c[x], c[x]]);
            }
        });
    }

    /// The grey values around the nodes of `plane` in row `y`; `None` if all edges have the same cost.
    pub(crate) fn around(&self, plane: usize, y: usize) -> Option<Around<'_>> {
        if self.values.is_empty() {
            return None;
        }
        // If there is no row above or below, no message goes there, so any values will do.
        let (above, below) = (y.saturating_sub(1), (y + 1).min(self.shape.size.height - 1));
        let beside = self.row(1 - plane, y);
        let same = &beside[WIDEST..];
        // An even column has its left neighbour in the pair before it, an odd one its right neighbour in the pair after it.
        let next = if plane == 0 { &beside[WIDEST - 1..] } else { &beside[WIDEST + 1..] };
        let neighbours = [same, next, self.lanes(plane, above), self.lanes(plane, below)];
        Some(Around { edges: &self.edges, own: self.lanes(plane, y), neighbours })
    }

    /// The values of `plane` in row `y` from lane 0 on.
    fn lanes(&self, plane: usize, y: usize) -> &[u8] {
        &self.row(plane, y)[WIDEST..]
    }

    fn row(&self, plane: usize, y: usize) -> &[u8] {
        let stride = stride(&self.shape);
        &self.values[(2 * y + plane) * stride..][..stride]
    }

    /// The bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        self.values.bytes()
    }
}

/// The bytes that [`Greys`] will hold.
pub(crate) fn bytes(plan: &Plan, grid: usize) -> u64 {
    let shape = Shape::new(plan, grid);
    if plan.model().edges().is_uniform() { 0 } else { (shape.size.height * 2 * stride(&shape)) as u64 }
}

/// The distance from one row of lanes to the next.
fn stride(shape: &Shape) -> usize {
    shape.lanes() + 2 * WIDEST
}

/// Both planes of a row, from lane 0 on.
fn planes_mut<'a>(shape: &Shape, row: &'a mut [u8]) -> [&'a mut [u8]; 2] {
    let (even, odd) = row.split_at_mut(stride(shape));
    [&mut even[WIDEST..][..shape.nodes(0)], &mut odd[WIDEST..][..shape.nodes(1)]]
}

/// The grey value of a node with these children.
#[inline(always)]
fn mean_of(children: [u8; 4]) -> u8 {
    Model::coarse_grey(children.map(u16::from).iter().sum(), 4)
}

/// Writes the grey values of a row to even and odd columns.
#[inline(always)]
fn load_row<S: Simd>(simd: S, greys: &[u8], even: &mut [u8], odd: &mut [u8]) {
    simd.vectorize(
        #[inline(always)]
        || deal(simd, even, odd, |first, columns, piece| piece[..columns].copy_from_slice(&greys[first..][..columns])),
    );
}

/// The grey values of the nodes of a plane in a row, and those of their neighbours by slot, each `[lane]`.
#[derive(Clone, Copy)]
pub(crate) struct Around<'a> {
    edges: &'a EdgeLevels,
    own: &'a [u8],
    neighbours: [&'a [u8]; 4],
}

impl Around<'_> {
    /// Swaps the last two slots, for an upward pass.
    pub(crate) fn upwards(mut self) -> Self {
        self.neighbours.swap(2, 3);
        self
    }

    /// The level of the edge of this slot.
    pub(crate) fn level(&self, slot: usize, lane: usize) -> usize {
        self.edges.level(self.own[lane].abs_diff(self.neighbours[slot][lane]))
    }

    /// The levels of the edges of this slot, for the nodes of a vector from `lane` on.
    #[inline(always)]
    pub(crate) fn levels<S: Simd, V: Vector<S>>(&self, simd: S, slot: usize, lane: usize) -> V {
        let load = |values: &[u8]| V::from_slice(simd, &values[lane..lane + V::LEN]);
        let (own, other) = (load(self.own), load(self.neighbours[slot]));
        let difference = own.saturating_sub(other) | other.saturating_sub(own);
        let [one, none] = [1, 0].map(|count| V::splat(simd, count));
        // No difference exceeds that of the last level.
        let [first, second, third, _] = self.edges.most();
        let mut level = none;
        for most in [first, second, third] {
            level += difference.simd_gt(V::splat(simd, most)).select(one, none);
        }
        level
    }
}

/// The value of each lane's level.
#[inline(always)]
pub(crate) fn of_levels<S: Simd, V: Vector<S>>(simd: S, levels: V, values: [u8; EdgeLevels::COUNT]) -> V {
    let table = u32x4::splat(simd, u32::from_ne_bytes(values));
    V::block_splat(table.bitcast::<u8x16<S>>()).swizzle_dyn_within_blocks(levels)
}
