//! Data costs of the blocks of a row.

use fearless_simd::{Simd, SimdBase};

use super::Sweep;
use crate::{
    block::{Block, Bytes, LANES},
    costs::{Costs, Sum, Sums, clip_above},
    match_cost::{Matching, PatchRow},
};

/// Where the costs of a grid come from.
pub(crate) enum CostSource<'a> {
    /// They are stored.
    Stored(&'a Costs),
    /// They are computed when needed, which takes less time than reading them from memory.
    Computed(Matching<'a>),
}

impl CostSource<'_> {
    /// The costs of a plane of a patch in row y, if they are stored as they are needed: for all labels.
    #[inline(always)]
    pub(crate) fn ready(&self, sweep: &Sweep<'_>, patch: usize, plane: usize, y: usize) -> Option<&[Block]> {
        match self {
            Self::Stored(stored) if !sweep.plan.has_label_sets(sweep.grid) => {
                let first = (2 * y + plane) * sweep.layout.plane();
                Some(&stored.stored[first..][sweep.layout.block(patch)])
            }
            Self::Stored(_) | Self::Computed(_) => None,
        }
    }

    /// Writes the costs of both planes of a patch in row y, for these labels, if they are not [`Self::ready`].
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
            Self::Computed(matching) => matching.patch(simd, PatchRow { grid: sweep.grid, patch, y }, labels, costs),
            Self::Stored(stored) => {
                for (plane, costs) in costs.into_iter().enumerate() {
                    let first = (2 * y + plane) * sweep.layout.plane() + sweep.layout.block(patch).start;
                    restricted(simd, sweep, stored, first, labels, costs);
                }
            }
        }
    }
}

/// Normalises and clips the costs from `first` on again, for the labels of a list.
#[inline(always)]
fn restricted<S: Simd>(simd: S, sweep: &Sweep<'_>, stored: &Costs, first: usize, labels: &[u16], costs: &mut [Block]) {
    let clip = sweep.plan.clip(sweep.grid);
    match &stored.sums {
        Sums::None => copy(&stored.stored[first..], labels, costs),
        Sums::U8(sums) => copy(&sums[first..], labels, costs),
        Sums::U16(sums) => return clipped(&sums[first..], labels, clip, costs),
        Sums::U32(sums) => return clipped(&sums[first..], labels, clip, costs),
        Sums::U64(sums) => return clipped(&sums[first..], labels, clip, costs),
    }
    normalise(simd, clip, costs);
}

/// Normalises wide costs by each node's least, and clips them.
fn clipped<T: Sum>(values: &[Block<T>], labels: &[u16], clip: u8, costs: &mut [Block]) {
    let mut least = [T::MAX; LANES];
    for &label in labels {
        let values = &values[usize::from(label)].0;
        least.iter_mut().zip(values).for_each(|(least, &value)| *least = value.min(*least));
    }
    for (&label, block) in labels.iter().zip(costs) {
        let values = values[usize::from(label)].0.iter().zip(least);
        block.0.iter_mut().zip(values).for_each(|(cost, (&value, least))| *cost = (value - least).clipped(clip));
    }
}

fn copy(values: &[Block], labels: &[u16], costs: &mut [Block]) {
    labels.iter().zip(costs).for_each(|(&label, block)| *block = values[usize::from(label)]);
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
