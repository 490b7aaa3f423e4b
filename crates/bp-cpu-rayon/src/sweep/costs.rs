//! Data costs of the blocks of a row.

use fearless_simd::{Simd, SimdBase};

use super::{
    Sweep,
    block::{Block, Bytes, LANES},
    match_cost::PatchRow,
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
    #[inline(always)]
    pub(crate) fn fill<S: Simd>(
        &self,
        simd: S,
        sweep: &Sweep<'_>,
        patch: usize,
        y: usize,
        labels: &[u16],
        costs: [&mut [Block]; 2],
    ) {
        match self {
            Self::Computed(matching) => matching.costs(simd, PatchRow { grid: sweep.grid, patch, y }, labels, costs),
            Self::Stored(stored) => {
                for (plane, costs) in costs.into_iter().enumerate() {
                    let first = (2 * y + plane) * sweep.layout.plane() + LANES * patch;
                    let entries = labels.iter().map(|&label| first + usize::from(label) * sweep.layout.lanes);
                    if sweep.plan.has_label_sets(sweep.grid) {
                        restricted(simd, sweep, stored, entries, costs);
                    } else {
                        copy(&stored.stored, entries, costs);
                    }
                }
            }
        }
    }
}

/// Normalises and clips costs again, for the labels of a list.
#[inline(always)]
fn restricted<S: Simd>(
    simd: S,
    sweep: &Sweep<'_>,
    stored: &Costs,
    entries: impl Iterator<Item = usize> + Clone,
    costs: &mut [Block],
) {
    let clip = sweep.plan.clip(sweep.grid);
    match &stored.sums {
        Sums::None => copy(&stored.stored, entries, costs),
        Sums::U8(sums) => copy(sums, entries, costs),
        Sums::U16(sums) => return clipped(sums, entries, clip, costs),
        Sums::U32(sums) => return clipped(sums, entries, clip, costs),
        Sums::U64(sums) => return clipped(sums, entries, clip, costs),
    }
    normalise(simd, clip, costs);
}

impl Matching<'_> {
    /// Writes the costs of both planes of a patch of grid 0 or 1, for these labels.
    #[inline(always)]
    fn costs<S: Simd>(&self, simd: S, at: PatchRow, labels: &[u16], [even, odd]: [&mut [Block]; 2]) {
        let (clip, clips) = (self.plan.clip(at.grid), at.grid > 0 || !self.fits());
        let least = self.unclipped(at, labels, [&mut *even, &mut *odd]);
        for (plane, (costs, least)) in [even, odd].into_iter().zip(least).enumerate() {
            if clips {
                clip_above(simd, &least, clip, costs);
            }
            if at.grid == 0 {
                self.fix_block(BlockStart { plane, lane: LANES * at.patch }, at.y, labels, costs);
            }
        }
    }

    /// As [`Matching::fix`], for a block.
    fn fix_block(&self, at: BlockStart, y: usize, labels: &[u16], costs: &mut [Block]) {
        let Some(seed) = self.seed else { return };
        for lane in 0..LANES {
            if seed.touches(2 * (at.lane + lane) + at.plane, y) {
                let cost = |&label: &u16| if label.abs_diff(seed.label) <= 1 { 0 } else { self.dear() };
                labels.iter().zip(&mut *costs).for_each(|(label, block)| block.0[lane] = cost(label));
            }
        }
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
fn normalise<S: Simd>(simd: S, clip: u8, costs: &mut [Block]) {
    let mut least = Bytes::<S>::splat(simd, u8::MAX);
    costs.iter().for_each(|block| least = least.min(block.load(simd)));
    let mut block = Block::ZERO;
    block.store(least);
    clip_above(simd, &block, clip, costs);
}

/// Subtracts each node's least cost, and clips the rest.
#[inline(always)]
pub(crate) fn clip_above<S: Simd>(simd: S, least: &Block, clip: u8, costs: &mut [Block]) {
    let (least, clip) = (least.load(simd), Bytes::splat(simd, clip));
    costs.iter_mut().for_each(|block| block.store((block.load(simd) - least).min(clip)));
}
