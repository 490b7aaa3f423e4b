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

use bp_core::Plan;
use fearless_simd::{Level, Simd, SimdBase, dispatch};
use rayon::prelude::*;

use crate::{
    block::{Block, Bytes, LANES},
    costs::{self, Costs, Kept, Sum, Sums, Widen, clip_above},
    layout::Layout,
    match_cost::{Matching, PatchRow, all_labels},
    sweep::Windows,
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

/// As [`coarsen`], for a `grid` whose finer grid's costs are not stored yet: computes them again, patch by patch. If they are to be
/// stored, but not their sums, `fine` is where.
pub(crate) fn coarsen_unstored(
    matching: &Matching<'_>,
    windows: &Windows,
    grid: usize,
    layouts: [&Layout; 2],
    fine: &mut Costs,
    coarse: &mut Costs,
) {
    match grid {
        1 | 2 => matching.narrow_rows(grid, layouts[1], coarse),
        _ => Unstored { matching, windows, grid, layouts }.rows(fine, coarse),
    }
}

/// A grid that is made from the images, by way of sums of the finer grid.
struct Unstored<'a> {
    matching: &'a Matching<'a>,
    windows: &'a Windows,
    grid: usize,
    layouts: [&'a Layout; 2],
}

impl Unstored<'_> {
    fn rows(&self, fine: &mut Costs, coarse: &mut Costs) {
        let (layout, clip) = (self.layouts[1], self.matching.plan.clip(self.grid));
        let Costs { stored, sums } = coarse;
        let fine = Some(&mut *fine.stored).filter(|stored| !stored.is_empty());
        let fine = costs::optional_rows(layout, fine, 2 * self.layouts[0].row());
        costs::rows(layout, stored, u16::of(sums)).zip(fine).for_each(|((y, stored, mut keep), mut fine)| {
            self.windows.with(|window| {
                for block in 0..layout.blocks {
                    let halves = self.halves(block, y, &mut window.work.costs, fine.as_deref_mut());
                    let keep = keep.as_deref_mut().map(|keep| layout.blocks_of(keep, block));
                    let stored = layout.blocks_of(stored, block);
                    dispatch!(self.matching.level, simd => store_sums(simd, clip, &halves, stored, keep));
                }
            });
        });
    }

    /// As [`Grids::halves`], for row y: computes what that finds, and stores it in two rows of `fine`.
    fn halves<'a>(
        &self,
        block: usize,
        y: usize,
        costs: &'a mut [Block],
        mut fine: Option<&mut [Block]>,
    ) -> [[&'a [Block]; 4]; 2] {
        let finer = self.layouts[0];
        let labels = all_labels(finer);
        let mut halves = [[&[][..]; 4]; 2];
        let patches = halves
            .iter_mut()
            .flat_map(|half| half.as_chunks_mut::<2>().0)
            .zip(costs.chunks_exact_mut(2 * labels.len()));
        for (index, (planes, costs)) in patches.enumerate() {
            let (patch, row) = (2 * block + index / 2, index % 2);
            let at = PatchRow { grid: self.grid - 1, patch, y: 2 * y + row };
            if patch < finer.blocks && at.y < finer.size.height {
                let (even, odd) = costs.split_at_mut(labels.len());
                let least = self.matching.unclipped(at, labels, [&mut *even, &mut *odd]);
                *planes = [even, odd];
                if let Some(fine) = fine.as_deref_mut() {
                    let to = finer.blocks_of(&mut fine[row * finer.row()..][..finer.row()], patch);
                    self.matching.store_clipped(at, &least, *planes, to);
                }
            }
        }
        halves
    }
}

struct Grids<'a> {
    level: Level,
    layouts: [&'a Layout; 2],
    clip: u8,
}

impl Grids<'_> {
    fn rows<F: Sum + Widen<C>, C: Kept>(&self, fine: &[Block<F>], coarse: &mut Costs) {
        let (layout, Costs { stored, sums }) = (self.layouts[1], coarse);
        costs::rows(layout, stored, C::of(sums)).for_each(|(y, stored, mut keep)| {
            let children = self.children(fine, y);
            for block in 0..layout.blocks {
                let halves = self.halves(children, block);
                let keep = keep.as_deref_mut().map(|keep| layout.blocks_of(keep, block));
                let stored = layout.blocks_of(stored, block);
                dispatch!(self.level, simd => store_sums(simd, self.clip, &halves, stored, keep));
            }
        });
    }

    /// As [`Grids::rows`], for sums that fit 8 bits, as those of the largest grids do.
    fn narrow_rows(&self, fine: &[Block], coarse: &mut Costs) {
        let (layout, Costs { stored, sums }) = (self.layouts[1], coarse);
        costs::rows(layout, stored, u8::of(sums)).for_each(|(y, stored, mut keep)| {
            let children = self.children(fine, y);
            for block in 0..layout.blocks {
                let keep = keep.as_deref_mut().map(|keep| layout.blocks_of(keep, block));
                dispatch!(self.level, simd => self.narrow_block(simd, children, block, layout.blocks_of(stored, block), keep));
            }
        });
    }

    /// The two rows of the finer grid that row `y` covers. If the second is missing, it is empty.
    fn children<'a, F>(&self, fine: &'a [Block<F>], y: usize) -> [&'a [Block<F>]; 2] {
        let row = self.layouts[0].row();
        let (upper, rest) = fine[2 * y * row..].split_at(row);
        [upper, rest.get(..row).unwrap_or_default()]
    }

    /// Sums the children of a block of nodes of both planes. The children of coarse column X are lane X of both fine planes.
    #[inline(always)]
    fn narrow_block<S: Simd>(
        &self,
        simd: S,
        children: [&[Block]; 2],
        block: usize,
        [even, odd]: [&mut [Block]; 2],
        keep: Option<[&mut [Block]; 2]>,
    ) {
        let halves = self.halves(children, block);
        let mut least = [Bytes::<S>::splat(simd, u8::MAX); 2];
        for (label, (even, odd)) in even.iter_mut().zip(&mut *odd).enumerate() {
            let [first, second] = halves.map(
                #[inline(always)]
                |blocks| sum_of_blocks(simd, blocks, label),
            );
            let sums = first.deinterleave(second);
            even.store(sums.0);
            odd.store(sums.1);
            least = [least[0].min(sums.0), least[1].min(sums.1)];
        }
        if let Some(keep) = keep {
            keep.into_iter().zip([&*even, &*odd]).for_each(|(keep, sums)| keep.copy_from_slice(sums));
        }
        clip_above(simd, &Block(least[0].into()), self.clip, even);
        clip_above(simd, &Block(least[1].into()), self.clip, odd);
    }

    /// The labels of the two blocks of fine nodes that have a block of coarse nodes as parents, each in both rows and planes. Empty
    /// where they do not exist, because the last block of coarse nodes may reach beyond the fine ones.
    fn halves<'a, F>(&self, [upper, lower]: [&'a [Block<F>]; 2], block: usize) -> [[&'a [Block<F>]; 4]; 2] {
        let fine = self.layouts[0];
        [2 * block, 2 * block + 1].map(|index| {
            [(upper, 0), (upper, 1), (lower, 0), (lower, 1)].map(|(row, plane)| {
                let exists = index < fine.blocks && !row.is_empty();
                if exists { &row[plane * fine.plane()..][fine.block(index)] } else { &[] }
            })
        })
    }
}

/// Sums blocks that hold a label each. Those that do not exist count as zeros.
#[inline(always)]
fn sum_of_blocks<S: Simd>(simd: S, blocks: [&[Block]; 4], label: usize) -> Bytes<S> {
    let [a, b, c, d] = blocks.map(
        #[inline(always)]
        |labels| labels.get(label).unwrap_or(&Block::ZERO).load(simd),
    );
    a + b + c + d
}

/// Stores the costs of a block of coarse nodes of both planes, which are sums of those of their children.
#[inline(always)]
fn store_sums<S: Simd, F: Sum + Widen<C>, C: Sum>(
    simd: S,
    clip: u8,
    halves: &[[&[Block<F>]; 4]; 2],
    stored: [&mut [Block]; 2],
    keep: Option<[&mut [Block<C>]; 2]>,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            costs::store_block(
                clip,
                #[inline(always)]
                |label| sums_of_children(simd, halves, label),
                stored,
                keep,
            );
        },
    );
}

/// Sums for a block of coarse nodes of both planes. The children of coarse column X are lane X of both planes, so those of lane
/// i of a coarse plane are lanes 2i + plane.
#[inline(always)]
fn sums_of_children<S: Simd, F: Sum + Widen<C>, C: Sum>(
    simd: S,
    halves: &[[&[Block<F>]; 4]; 2],
    label: usize,
) -> [[C; LANES]; 2] {
    let none = &Block([F::default(); LANES]);
    F::sum_by_parity(
        simd,
        halves.map(
            #[inline(always)]
            |blocks| blocks.map(|labels| labels.get(label).unwrap_or(none)),
        ),
    )
}
