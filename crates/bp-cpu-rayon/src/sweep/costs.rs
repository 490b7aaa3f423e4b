//! Data costs of the blocks of a row.

use fearless_simd::{Simd, SimdBase, dispatch};

use super::{
    Sweep,
    block::{Block, Bytes, LANES},
};
use crate::{
    costs::{Costs, Sum, Sums},
    match_cost::Matching,
    shape::BlockStart,
};

/// Where the costs of a grid come from.
pub(crate) enum CostSource<'a> {
    /// They are stored.
    Stored(&'a Costs),
    /// They are computed when needed, which takes less time than reading them from memory.
    Computed(Matching<'a>),
}

impl CostSource<'_> {
    /// Writes the costs of both planes of a patch in row y, for these labels.
    pub(crate) fn fill(&self, sweep: &Sweep<'_>, patch: usize, y: usize, labels: &[u16], costs: [&mut [Block]; 2]) {
        match self {
            Self::Computed(matching) => matching.costs(sweep.grid, patch, y, labels, costs),
            Self::Stored(stored) => {
                for (plane, costs) in costs.into_iter().enumerate() {
                    let first = (2 * y + plane) * sweep.layout.plane() + LANES * patch;
                    let entries = labels.iter().map(|&label| first + usize::from(label) * sweep.layout.lanes);
                    if sweep.plan.has_label_sets(sweep.grid) {
                        restricted(sweep, stored, entries, costs);
                    } else {
                        copy(&stored.stored, entries, costs);
                    }
                }
            }
        }
    }
}

/// Normalises and clips costs again, for the labels of a list.
fn restricted(sweep: &Sweep<'_>, stored: &Costs, entries: impl Iterator<Item = usize> + Clone, costs: &mut [Block]) {
    let clip = sweep.plan.clip(sweep.grid);
    match &stored.sums {
        Sums::None => copy(&stored.stored, entries, costs),
        Sums::U8(sums) => copy(sums, entries, costs),
        Sums::U16(sums) => return clipped(sums, entries, clip, costs),
        Sums::U32(sums) => return clipped(sums, entries, clip, costs),
        Sums::U64(sums) => return clipped(sums, entries, clip, costs),
    }
    dispatch!(sweep.level, simd => normalise(simd, clip, costs));
}

impl Matching<'_> {
    /// Writes the costs of both planes of a patch of grid 0 or 1 in row y, for these labels.
    fn costs(&self, grid: usize, patch: usize, y: usize, labels: &[u16], [even, odd]: [&mut [Block]; 2]) {
        let (clip, clips) = (self.plan.clip(grid), grid > 0 || !self.fits());
        self.unclipped(grid, patch, y, labels, [&mut *even, &mut *odd], &mut []);
        for (plane, costs) in [even, odd].into_iter().enumerate() {
            if clips {
                dispatch!(self.level, simd => normalise(simd, clip, costs));
            }
            if grid == 0 {
                self.fix_block(BlockStart { plane, lane: LANES * patch }, y, labels, costs);
            }
        }
    }

    /// Writes the unclipped costs of both planes of a patch of grid 0, 1 or 2 in row y, for these labels. They must fit 8
    /// bits. Grid 2 needs room for both planes of a patch of grid 1.
    pub(crate) fn unclipped(
        &self,
        grid: usize,
        patch: usize,
        y: usize,
        labels: &[u16],
        [even, odd]: [&mut [Block]; 2],
        finer: &mut [Block],
    ) {
        if grid == 0 {
            for (plane, costs) in [even, odd].into_iter().enumerate() {
                self.pixels(BlockStart { plane, lane: LANES * patch }, y, labels, costs);
            }
            return;
        }
        let size = self.plan.size(grid - 1);
        for (half, sums) in [&mut *even, &mut *odd].into_iter().enumerate() {
            let child = 2 * patch + half;
            if 2 * LANES * child >= size.width {
                sums.fill(Block::ZERO);
            } else if grid == 1 {
                self.squares(LANES * child, 2 * y, labels, sums);
            } else {
                for y in 2 * y..size.height.min(2 * y + 2) {
                    let (first, second) = finer.split_at_mut(labels.len());
                    self.unclipped(1, child, y, labels, [first, second], &mut []);
                    dispatch!(self.level, simd => sum(simd, first, second, sums, y % 2 == 1));
                }
            }
        }
        dispatch!(self.level, simd => deal(simd, even, odd));
    }
}

/// Writes the sums of two planes, or adds them to what `sums` hold.
#[inline(always)]
fn sum<S: Simd>(simd: S, first: &[Block], second: &[Block], sums: &mut [Block], add: bool) {
    for ((first, second), sum) in first.iter().zip(second).zip(sums) {
        let both = first.load(simd) + second.load(simd);
        sum.store(if add { both + sum.load(simd) } else { both });
    }
}

/// Deals the values of 64 consecutive columns, of which each slice has 32, to even and odd columns.
#[inline(always)]
fn deal<S: Simd>(simd: S, first: &mut [Block], second: &mut [Block]) {
    for (first, second) in first.iter_mut().zip(second) {
        let (even, odd) = first.load(simd).deinterleave(second.load(simd));
        first.store(even);
        second.store(odd);
    }
}

fn copy(values: &[u8], entries: impl Iterator<Item = usize>, costs: &mut [Block]) {
    for (start, block) in entries.zip(costs) {
        block.0.copy_from_slice(&values[start..start + LANES]);
    }
}

/// Normalises wide costs by each node's least, and clips them.
fn clipped<T: Sum>(values: &[T], entries: impl Iterator<Item = usize> + Clone, clip: u8, costs: &mut [Block]) {
    let mut least = [T::MAX; LANES];
    for start in entries.clone() {
        least.iter_mut().zip(&values[start..]).for_each(|(least, &value)| *least = value.min(*least));
    }
    for (start, block) in entries.zip(costs) {
        let values = values[start..].iter().zip(least);
        block.0.iter_mut().zip(values).for_each(|(cost, (&value, least))| *cost = (value - least).clipped(clip));
    }
}

/// Normalises costs by each node's least, and clips them.
#[inline(always)]
pub(crate) fn normalise<S: Simd>(simd: S, clip: u8, costs: &mut [Block]) {
    let mut least = Bytes::<S>::splat(simd, u8::MAX);
    costs.iter().for_each(|block| least = least.min(block.load(simd)));
    let clip = Bytes::splat(simd, clip);
    costs.iter_mut().for_each(|block| block.store((block.load(simd) - least).min(clip)));
}
