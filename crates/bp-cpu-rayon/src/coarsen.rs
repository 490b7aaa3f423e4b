//! Data costs of a coarser grid.
//!
//! In the terms of `bp-cpu-scalar`, the kernel computes:
//!
//! ```text
//! for each node (X, Y) of the coarse grid:
//!     for each label d:   sum(d) = sum of the unclipped costs of its children (2X, 2Y), (2X + 1, 2Y), (2X, 2Y + 1), ...
//!     least = min over d of sum(d)
//!     for each label d:   cost(d) = min(sum(d) - least, clip)
//! ```
//!
//! Here one lane of a vector is one coarse node.

use std::array;

use bp_core::{MAX_LABELS, Patch, Plan};
use fearless_simd::{Level, Simd, SimdBase, dispatch};

use crate::{
    costs::{self, Costs, Sum, Sums, Widen, block},
    layout::Layout,
    match_cost::Matching,
    shape::{BLOCK, STRIP, Strip},
    sweep::{Block, LANES, PatchRow, Windows, clip_above},
};

/// Computes the costs of `grid` from those of the finer grid, `grid - 1`. `layouts` has the layouts of both, the finer
/// one first.
pub(crate) fn coarsen(level: Level, plan: &Plan, grid: usize, layouts: [&Layout; 2], fine: &Costs, coarse: &mut Costs) {
    let args = Grids { level, layouts, clip: plan.clip(grid) };
    // The width of the sums determines the type, even if they are not kept.
    let bytes = plan.sum_bytes(grid);
    match (&fine.sums, bytes) {
        (Sums::None, 1) => args.narrow_rows(&fine.stored, coarse),
        (Sums::U8(sums), 1) => args.narrow_rows(sums, coarse),
        (Sums::None, _) => args.rows::<u8, u16>(&fine.stored, coarse),
        (Sums::U8(sums), _) => args.rows::<u8, u16>(sums, coarse),
        (Sums::U16(sums), 2) => args.rows::<u16, u16>(sums, coarse),
        (Sums::U16(sums), _) => args.rows::<u16, u32>(sums, coarse),
        (Sums::U32(sums), 4) => args.rows::<u32, u32>(sums, coarse),
        (Sums::U32(sums), _) => args.rows::<u32, u64>(sums, coarse),
        (Sums::U64(sums), _) => args.rows::<u64, u64>(sums, coarse),
    }
}

/// As [`coarsen`], for a `grid` whose finer grid's costs are not stored: computes them again, patch by patch.
pub(crate) fn coarsen_unstored(
    matching: &Matching<'_>,
    windows: &Windows,
    grid: usize,
    layout: &Layout,
    coarse: &mut Costs,
) {
    let labels = array::from_fn::<u16, MAX_LABELS, _>(|label| label as u16);
    let unstored = Unstored { matching, windows, grid, layout, labels: &labels[..layout.labels] };
    match grid {
        1 | 2 => unstored.narrow_rows(coarse),
        _ => unstored.rows(coarse),
    }
}

/// A grid that is made from the images.
struct Unstored<'a> {
    matching: &'a Matching<'a>,
    windows: &'a Windows,
    grid: usize,
    layout: &'a Layout,
    labels: &'a [u16],
}

impl Unstored<'_> {
    /// Sums of grid 1 or 2, which fit 8 bits.
    fn narrow_rows(&self, coarse: &mut Costs) {
        let (layout, level, clip) = (self.layout, self.matching.level, self.matching.plan.clip(self.grid));
        let Costs { stored, sums } = coarse;
        costs::rows(layout, stored, u8::of(sums), |y, stored, mut keep| {
            self.windows.with(|window| {
                let (even, rest) = window.work.costs.split_at_mut(self.labels.len());
                let odd = &mut rest[..self.labels.len()];
                for patch in 0..layout.size.width.div_ceil(Patch::COLUMNS) {
                    let at = PatchRow { grid: self.grid, patch, y };
                    let least = self.matching.unclipped(at, self.labels, [&mut *even, &mut *odd]);
                    for (plane, (costs, least)) in [&mut *even, &mut *odd].into_iter().zip(least).enumerate() {
                        let first = plane * layout.plane() + LANES * patch;
                        if let Some(keep) = keep.as_deref_mut() {
                            store(layout, costs, &mut keep[first..]);
                        }
                        dispatch!(level, simd => clip_above(simd, &least, clip, costs));
                        store(layout, costs, &mut stored[first..]);
                    }
                }
            });
        });
    }

    /// Sums of grid 3, which are made of sums of grid 2.
    fn rows(&self, coarse: &mut Costs) {
        let (layout, clip) = (self.layout, self.matching.plan.clip(self.grid));
        let Costs { stored, sums } = coarse;
        costs::rows(layout, stored, u16::of(sums), |y, stored, mut keep| {
            self.windows.with(|window| {
                for lane in (0..layout.nodes(0)).step_by(BLOCK) {
                    let (children, rest) = window.work.costs.split_at_mut(CHILDREN * self.labels.len());
                    self.sum_pairs(lane, y, children, rest);
                    let keep = keep.as_deref_mut();
                    dispatch!(self.matching.level, simd => simd.vectorize(
                        #[inline(always)]
                        || costs::store_block(
                            layout,
                            clip,
                            lane,
                            #[inline(always)]
                            |label| sum_of_rows(&children[CHILDREN * label..][..CHILDREN]),
                            stored,
                            keep,
                        ),
                    ));
                }
            });
        });
    }

    /// For a block of nodes in row y, writes the sums of the pairs of children in each row below it, `[label][half][row][plane]`.
    fn sum_pairs(&self, lane: usize, y: usize, children: &mut [Block], costs: &mut [Block]) {
        let finer = self.matching.plan.size(self.grid - 1);
        let (even, rest) = costs.split_at_mut(self.labels.len());
        let odd = &mut rest[..self.labels.len()];
        children.fill(Block::ZERO);
        for (child, row) in (0..4).flat_map(|child| [0, 1].map(|row| (child, row))) {
            let at = PatchRow { grid: self.grid - 1, patch: 2 * lane / LANES + child, y: 2 * y + row };
            if Patch::COLUMNS * at.patch >= finer.width || at.y >= finer.height {
                continue;
            }
            self.matching.unclipped(at, self.labels, [&mut *even, &mut *odd]);
            let slot = 4 * (child / 2) + 2 * row;
            for (label, children) in children.chunks_exact_mut(CHILDREN).enumerate() {
                deal_pairs(&even[label], &odd[label], child % 2, &mut children[slot..slot + 2]);
            }
        }
    }
}

/// The blocks that hold the children of a block of nodes of both planes: two halves, two rows and two planes.
const CHILDREN: usize = 8;

/// Sums pairs of columns of a patch, and writes them to the first or second half of a block of each plane.
fn deal_pairs(even: &Block, odd: &Block, half: usize, to: &mut [Block]) {
    let (first, second) = to.split_at_mut(1);
    let range = half * LANES / 2..(half + 1) * LANES / 2;
    let both = first[0].0[range.clone()].iter_mut().zip(&mut second[0].0[range]);
    let pairs = even.0.chunks_exact(2).zip(odd.0.chunks_exact(2));
    for ((first, second), (even, odd)) in both.zip(pairs) {
        (*first, *second) = (even[0] + odd[0], even[1] + odd[1]);
    }
}

/// The sums of the children of a block of nodes in both rows.
#[inline(always)]
fn sum_of_rows(children: &[Block]) -> [[u16; BLOCK]; 2] {
    let mut sums = [[0; BLOCK]; 2];
    for (half, rows) in children.chunks_exact(CHILDREN / 2).enumerate() {
        for (i, row) in rows.iter().enumerate() {
            let sums = sums[i % 2][half * LANES..(half + 1) * LANES].iter_mut();
            sums.zip(row.0).for_each(|(sum, value)| *sum += u16::from(value));
        }
    }
    sums
}

/// Stores the blocks of all labels.
fn store(layout: &Layout, costs: &[Block], stored: &mut [u8]) {
    for (label, block) in costs.iter().enumerate() {
        stored[label * layout.lanes..][..LANES].copy_from_slice(&block.0);
    }
}

struct Grids<'a> {
    level: Level,
    layouts: [&'a Layout; 2],
    clip: u8,
}

/// A type of sums that a grid may keep.
pub(crate) trait Kept: Sum {
    fn of(sums: &mut Sums) -> Option<&mut [Self]>;
}

macro_rules! kept {
    ($($type:ty => $variant:ident),*) => { $(
        impl Kept for $type {
            fn of(sums: &mut Sums) -> Option<&mut [Self]> {
                if let Sums::$variant(sums) = sums { Some(sums) } else { None }
            }
        }
    )* };
}

kept!(u8 => U8, u16 => U16, u32 => U32, u64 => U64);

impl Grids<'_> {
    fn rows<F: Sum + Widen<C>, C: Kept>(&self, fine: &[F], coarse: &mut Costs) {
        let Costs { stored, sums } = coarse;
        costs::rows(self.layouts[1], stored, C::of(sums), |y, stored, keep| {
            let (fine_layout, children) = (self.layouts[0], self.children(fine, y));
            dispatch!(self.level, simd => costs::store(
                simd,
                self.layouts[1],
                self.clip,
                #[inline(always)]
                |lane, label| sum_children(fine_layout, children, lane, label),
                stored,
                keep,
            ));
        });
    }

    /// As [`Grids::rows`], for sums that fit 8 bits, as those of the largest grids do.
    fn narrow_rows(&self, fine: &[u8], coarse: &mut Costs) {
        let Costs { stored, sums } = coarse;
        costs::rows(self.layouts[1], stored, u8::of(sums), |y, stored, keep| {
            let children = self.children(fine, y);
            dispatch!(self.level, simd => self.narrow_row(simd, children, stored, keep));
        });
    }

    /// The two rows of the finer grid that row `y` covers. If the second is missing, it is empty.
    fn children<'a, F>(&self, fine: &'a [F], y: usize) -> [&'a [F]; 2] {
        let row = self.layouts[0].row();
        let (upper, rest) = fine[2 * y * row..].split_at(row);
        [upper, rest.get(..row).unwrap_or_default()]
    }

    #[inline(always)]
    fn narrow_row<S: Simd>(&self, simd: S, children: [&[u8]; 2], stored: &mut [u8], mut keep: Option<&mut [u8]>) {
        let layout = self.layouts[1];
        simd.vectorize(
            #[inline(always)]
            || {
                for strip in layout.strips(0) {
                    let raw = keep.as_deref_mut().unwrap_or(&mut *stored);
                    let least = self.narrow_strip(simd, children, strip, raw);
                    for (plane, least) in least.iter().enumerate() {
                        let range = plane * layout.plane()..(plane + 1) * layout.plane();
                        let kept = keep.as_deref().map(|keep| &keep[range.clone()]);
                        costs::normalise(simd, layout, strip, self.clip, least, kept, &mut stored[range]);
                    }
                }
            },
        );
    }

    /// Sums the children of a strip of nodes in both planes, and returns the least cost of each node.
    #[inline(always)]
    fn narrow_strip<S: Simd>(&self, simd: S, children: [&[u8]; 2], strip: Strip, raw: &mut [u8]) -> [[u8; STRIP]; 2] {
        let [fine, layout] = self.layouts;
        let (first, second) = raw.split_at_mut(layout.plane());
        let raw = [first, second];
        let mut least = [[u8::MAX; STRIP]; 2];
        for label in 0..layout.labels {
            let rows = children.map(|row| {
                let lanes = |plane: usize| row.get(plane * fine.plane() + label * fine.lanes..).unwrap_or_default();
                [lanes(0), lanes(1)].map(|lanes| lanes.get(..fine.lanes).unwrap_or_default())
            });
            for lane in (0..strip.lanes).step_by(S::u8s::LEN) {
                let from = 2 * (strip.first + lane);
                let half = |from: usize| sum_of_children(simd, &rows, from);
                let planes = half(from).deinterleave(half(from + S::u8s::LEN));
                for (plane, sum) in [planes.0, planes.1].into_iter().enumerate() {
                    let start = label * layout.lanes + strip.first + lane;
                    sum.store_slice(&mut raw[plane][start..start + S::u8s::LEN]);
                    let least = &mut least[plane][lane..lane + S::u8s::LEN];
                    sum.min(S::u8s::from_slice(simd, least)).store_slice(least);
                }
            }
        }
        least
    }
}

/// Sums a vector of fine lanes over both planes and rows. Lanes beyond the end count as zeros.
#[inline(always)]
fn sum_of_children<S: Simd>(simd: S, rows: &[[&[u8]; 2]; 2], from: usize) -> S::u8s {
    let mut sum = S::u8s::splat(simd, 0);
    for lanes in rows.iter().flatten() {
        if from < lanes.len() {
            sum += S::u8s::from_slice(simd, &lanes[from..from + S::u8s::LEN]);
        }
    }
    sum
}

/// Sums for a block of coarse nodes of both planes. The children of coarse column X are lane X of both planes, so those of lane
/// i of a coarse plane are lanes 2i + plane.
#[inline(always)]
fn sum_children<F: Sum + Widen<C>, C: Sum>(
    fine: &Layout,
    children: [&[F]; 2],
    lane: usize,
    label: usize,
) -> [[C; BLOCK]; 2] {
    let mut sums = [C::default(); 2 * BLOCK];
    // The last block of coarse lanes may reach beyond the fine ones.
    let blocks = (2 * lane..fine.lanes).step_by(BLOCK);
    for (from, sums) in blocks.zip(sums.chunks_exact_mut(BLOCK)) {
        for row in children.into_iter().filter(|row| !row.is_empty()) {
            for plane in 0..2 {
                let lanes = block(row, plane * fine.plane() + label * fine.lanes + from);
                sums.iter_mut().zip(lanes).for_each(|(sum, lane)| *sum = *sum + lane.widen());
            }
        }
    }
    [0, 1].map(
        #[inline(always)]
        |plane| {
            let mut every_second = [C::default(); BLOCK];
            for (i, sum) in every_second.iter_mut().enumerate() {
                *sum = sums[2 * i + plane];
            }
            every_second
        },
    )
}
