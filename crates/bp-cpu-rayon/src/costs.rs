//! The data costs of one grid.

use bp_core::{Error, IsStopped, Plan, memory::Buffer};
use fearless_simd::{Bytes as _, Simd, SimdBase, SimdCombine, u16x16, u16x32};
use rayon::{iter::Either, prelude::*};

use crate::{
    block::{Block, Bytes, LANES},
    shape::Shape,
    stored::keeps_sums,
};

/// Data costs `[height][plane][block][label]`, in the forms that messages and the sums of coarser grids need.
pub(crate) struct Costs {
    /// Normalised by each node's least cost and clipped at [`Plan::clip`], unless sums fit 8 bits without that.
    pub(crate) stored: Buffer<Block>,
    /// Neither normalised nor clipped. Only present if the plan keeps them.
    pub(crate) sums: Sums,
}

/// Unclipped costs in the narrowest integer that holds them.
pub(crate) enum Sums {
    /// None are kept, because the stored costs are used instead.
    None,
    U8(Buffer<Block>),
    U16(Buffer<Block<u16>>),
    U32(Buffer<Block<u32>>),
    U64(Buffer<Block<u64>>),
}

impl Costs {
    /// Allocates room for the costs of `grid`.
    pub(crate) fn new(plan: &Plan, grid: usize, is_stopped: IsStopped<'_>) -> Result<Self, Error> {
        let (what, len) = ("data cost sums", volume(&Shape::new(plan, grid)));
        let sums = match plan.sum_bytes(grid) {
            _ if !keeps_sums(plan, grid) => Sums::None,
            1 => Sums::U8(Buffer::filled_unless(is_stopped, what, len, Block::ZERO)?),
            2 => Sums::U16(Buffer::filled_unless(is_stopped, what, len, Block([0; LANES]))?),
            4 => Sums::U32(Buffer::filled_unless(is_stopped, what, len, Block([0; LANES]))?),
            _ => Sums::U64(Buffer::filled_unless(is_stopped, what, len, Block([0; LANES]))?),
        };
        Ok(Self { stored: Buffer::filled_unless(is_stopped, "data cost", len, Block::ZERO)?, sums })
    }

    /// Allocates nothing.
    pub(crate) fn none() -> Self {
        Self { stored: Buffer::default(), sums: Sums::None }
    }

    /// The bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        self.stored.bytes()
            + match &self.sums {
                Sums::None => 0,
                Sums::U8(sums) => sums.bytes(),
                Sums::U16(sums) => sums.bytes(),
                Sums::U32(sums) => sums.bytes(),
                Sums::U64(sums) => sums.bytes(),
            }
    }
}

/// The number of blocks of costs of a grid.
fn volume(shape: &Shape) -> usize {
    shape.row().saturating_mul(shape.size.height)
}

/// The bytes that [`Costs`] will hold.
pub(crate) fn bytes(plan: &Plan, grid: usize) -> u64 {
    let len = volume(&Shape::new(plan, grid));
    let sums = if keeps_sums(plan, grid) { plan.sum_bytes(grid) } else { 0 };
    (len as u64).saturating_mul((LANES * (1 + sums)) as u64)
}

/// All rows of a grid, for several threads: y, the stored costs and the sums.
pub(crate) fn rows<'a, T: Send>(
    shape: &Shape,
    stored: &'a mut [Block],
    sums: Option<&'a mut [Block<T>]>,
) -> impl IndexedParallelIterator<Item = (usize, &'a mut [Block], Option<&'a mut [Block<T>]>)> {
    let stored = stored.par_chunks_exact_mut(shape.row());
    let rows = stored.zip(optional_rows(shape, sums, shape.row())).enumerate();
    rows.map(|(y, (stored, sums))| (y, stored, sums))
}

/// So many blocks for each row of a grid, if there are any. The last row may have fewer.
pub(crate) fn optional_rows<'a, T: Send>(
    shape: &Shape,
    blocks: Option<&'a mut [Block<T>]>,
    row: usize,
) -> impl IndexedParallelIterator<Item = Option<&'a mut [Block<T>]>> {
    match blocks {
        Some(blocks) => Either::Left(blocks.par_chunks_mut(row).map(Some)),
        None => Either::Right((0..shape.size.height).into_par_iter().map(|_| None)),
    }
}

/// An unsigned integer that costs are summed in.
pub(crate) trait Sum:
    Copy + Default + Ord + Send + Sync + std::ops::Add<Output = Self> + std::ops::Sub<Output = Self>
{
    const MAX: Self;

    /// Clips at `clip`.
    fn clipped(self, clip: u8) -> u8;
}

/// A narrower integer that can be made wider.
pub(crate) trait Widen<T: Sum>: Sum {
    fn widen(self) -> T;

    /// Sums the four blocks of each half: lane i of the first sum has lane 2i of both halves together, that of the second lane 2i + 1.
    #[inline(always)]
    fn sum_by_parity<S: Simd>(_: S, halves: [[&Block<Self>; 4]; 2]) -> [[T; LANES]; 2] {
        let mut sums = [[T::default(); LANES]; 2];
        for (sums, blocks) in sums.iter_mut().zip(halves) {
            let [a, b, c, d] = blocks.map(|block| &block.0);
            for (i, sum) in sums.iter_mut().enumerate() {
                *sum = a[i].widen() + b[i].widen() + (c[i].widen() + d[i].widen());
            }
        }
        let pairs = sums.as_flattened().as_chunks::<2>().0;
        [0, 1].map(|parity| std::array::from_fn(|i| pairs[i][parity]))
    }
}

impl Widen<u16> for u8 {
    #[inline(always)]
    fn widen(self) -> u16 {
        self.into()
    }

    /// Two bytes make a number of 16 bits; the even lane is its lower half, or on some machines its upper half.
    #[inline(always)]
    fn sum_by_parity<S: Simd>(simd: S, halves: [[&Block; 4]; 2]) -> [[u16; LANES]; 2] {
        // Loops are inlined where `map` is not.
        let mut sums = [[u16x16::splat(simd, 0); 2]; 2];
        for (blocks, [lower, upper]) in halves.iter().zip(&mut sums) {
            for block in blocks {
                let pairs: u16x16<S> = block.load(simd).bitcast();
                *lower += pairs & u16x16::splat(simd, 0xff);
                *upper += pairs >> 8;
            }
        }
        let [[lower, upper], [next_lower, next_upper]] = sums;
        let [lower, upper] = [lower.combine(next_lower).into(), upper.combine(next_upper).into()];
        if cfg!(target_endian = "big") { [upper, lower] } else { [lower, upper] }
    }
}

impl Widen<u16> for u16 {
    #[inline(always)]
    fn widen(self) -> u16 {
        self
    }

    #[inline(always)]
    fn sum_by_parity<S: Simd>(simd: S, halves: [[&Block<u16>; 4]; 2]) -> [[u16; LANES]; 2] {
        let mut sums = [u16x32::splat(simd, 0); 2];
        for (blocks, sum) in halves.iter().zip(&mut sums) {
            for block in blocks {
                *sum += u16x32::load_array_ref(simd, &block.0);
            }
        }
        let (even, odd) = sums[0].deinterleave(sums[1]);
        [even.into(), odd.into()]
    }
}

macro_rules! sums {
    ($($type:ty),*) => { $(
        impl Sum for $type {
            const MAX: Self = <$type>::MAX;

            #[inline(always)]
            fn clipped(self, clip: u8) -> u8 {
                self.min(clip.into()) as u8
            }
        }
    )* };
}

sums!(u8, u16, u32, u64);

macro_rules! widen {
    ($($from:ty => $to:ty),*) => { $(
        impl Widen<$to> for $from {
            #[inline(always)]
            fn widen(self) -> $to {
                self.into()
            }
        }
    )* };
}

widen!(u16 => u32, u32 => u32, u32 => u64, u64 => u64);

/// A type of sums that a grid may keep.
pub(crate) trait Kept: Sum {
    fn of(sums: &mut Sums) -> Option<&mut [Block<Self>]>;
}

macro_rules! kept {
    ($($type:ty => $variant:ident),*) => { $(
        impl Kept for $type {
            fn of(sums: &mut Sums) -> Option<&mut [Block<Self>]> {
                if let Sums::$variant(sums) = sums { Some(sums) } else { None }
            }
        }
    )* };
}

kept!(u8 => U8, u16 => U16, u32 => U32, u64 => U64);

/// Stores the costs of a row, block by block. `raw(block, label)` returns the unclipped costs of a block of both planes, which
/// are also written to `keep`.
#[inline(always)]
pub(crate) fn store<S: Simd, T: Sum>(
    simd: S,
    shape: &Shape,
    clip: u8,
    raw: impl Fn(usize, usize) -> [[T; LANES]; 2],
    stored: &mut [Block],
    mut keep: Option<&mut [Block<T>]>,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            for block in 0..shape.blocks {
                store_block(
                    clip,
                    #[inline(always)]
                    |label| raw(block, label),
                    shape.blocks_of(stored, block),
                    keep.as_deref_mut().map(|keep| shape.blocks_of(keep, block)),
                );
            }
        },
    );
}

/// Stores the costs of a block of both planes, for all labels. Goes over them twice, because the least cost is known only after
/// the first time. The second time it calls `raw` again, unless the costs were kept.
#[inline(always)]
pub(crate) fn store_block<T: Sum>(
    clip: u8,
    raw: impl Fn(usize) -> [[T; LANES]; 2],
    stored: [&mut [Block]; 2],
    mut keep: Option<[&mut [Block<T>]; 2]>,
) {
    let mut least = [[T::MAX; LANES]; 2];
    for label in 0..stored[0].len() {
        let costs = raw(label);
        for plane in 0..2 {
            least[plane].iter_mut().zip(costs[plane]).for_each(|(least, cost)| *least = cost.min(*least));
            if let Some(keep) = &mut keep {
                keep[plane][label] = Block(costs[plane]);
            }
        }
    }
    for label in 0..stored[0].len() {
        let costs = match &keep {
            Some(keep) => [keep[0][label].0, keep[1][label].0],
            None => raw(label),
        };
        for plane in 0..2 {
            let stored = stored[plane][label].0.iter_mut().zip(costs[plane]).zip(least[plane]);
            stored.for_each(|((stored, cost), least)| *stored = (cost - least).clipped(clip));
        }
    }
}

/// Subtracts each node's least cost, and clips the rest.
#[inline(always)]
pub(crate) fn clip_above<S: Simd>(simd: S, least: &Block, clip: u8, costs: &mut [Block]) {
    let (least, clip) = (least.load(simd), Bytes::splat(simd, clip));
    costs.iter_mut().for_each(|block| block.store((block.load(simd) - least).min(clip)));
}

/// As [`clip_above`], and writes the result to other blocks.
#[inline(always)]
pub(crate) fn copy_clipped<S: Simd>(simd: S, least: &Block, clip: u8, costs: &[Block], to: &mut [Block]) {
    let (least, clip) = (least.load(simd), Bytes::splat(simd, clip));
    to.iter_mut().zip(costs).for_each(|(to, block)| to.store((block.load(simd) - least).min(clip)));
}
