//! The data costs of one grid.

use bp_core::{Error, Plan};
use fearless_simd::{Simd, SimdBase};
use rayon::prelude::*;

use crate::{
    lines::{self, Lines},
    shape::{BLOCK, STRIP, Shape, Strip},
};

/// Data costs `[height][plane][label][lane]`, in the forms that messages and the sums of coarser grids need.
pub(crate) struct Costs {
    /// Normalised by each node's least cost and clipped at [`Plan::clip`], unless sums fit 8 bits without that.
    pub(crate) stored: Lines<u8>,
    /// Neither normalised nor clipped. Only present if the plan keeps them.
    pub(crate) sums: Sums,
}

/// Unclipped costs in the narrowest integer that holds them.
pub(crate) enum Sums {
    /// None are kept, because the stored costs are used instead.
    None,
    U8(Lines<u8>),
    U16(Lines<u16>),
    U32(Lines<u32>),
    U64(Lines<u64>),
}

impl Costs {
    /// Allocates room for the costs of `grid`.
    pub(crate) fn new(plan: &Plan, grid: usize) -> Result<Self, Error> {
        let (what, len) = ("data cost sums", volume(&Shape::new(plan, grid)));
        let sums = match plan.sum_bytes(grid) {
            _ if !plan.keeps_sums(grid) => Sums::None,
            1 => Sums::U8(Lines::new(what, len)?),
            2 => Sums::U16(Lines::new(what, len)?),
            4 => Sums::U32(Lines::new(what, len)?),
            _ => Sums::U64(Lines::new(what, len)?),
        };
        Ok(Self { stored: Lines::new("data cost", len)?, sums })
    }

    /// Allocates nothing.
    pub(crate) fn none() -> Self {
        Self { stored: Lines::none(), sums: Sums::None }
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

/// The number of costs of a grid, including padding.
pub(crate) fn volume(shape: &Shape) -> usize {
    shape.row().saturating_mul(shape.size.height)
}

/// The bytes that [`Costs`] will hold.
pub(crate) fn bytes(plan: &Plan, grid: usize) -> u64 {
    let len = volume(&Shape::new(plan, grid));
    let sums = if plan.keeps_sums(grid) { lines::bytes(len, plan.sum_bytes(grid)) } else { 0 };
    lines::bytes(len, 1).saturating_add(sums)
}

/// Calls `row(y, stored, sums)` for all rows of a grid, on several threads.
pub(crate) fn rows<T: Send>(
    shape: &Shape,
    stored: &mut [u8],
    sums: Option<&mut [T]>,
    row: impl Fn(usize, &mut [u8], Option<&mut [T]>) + Sync,
) {
    let stored = stored.par_chunks_exact_mut(shape.row());
    match sums {
        Some(sums) => {
            let both = stored.zip(sums.par_chunks_exact_mut(shape.row())).enumerate();
            both.for_each(|(y, (stored, sums))| row(y, stored, Some(sums)));
        }
        None => stored.enumerate().for_each(|(y, stored)| row(y, stored, None)),
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
pub(crate) trait Widen<T> {
    fn widen(self) -> T;
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

widen!(u8 => u16, u16 => u16, u16 => u32, u32 => u32, u32 => u64, u64 => u64);

/// Stores the costs of a row, block by block. `raw(lane, label)` returns the unclipped costs of a block of both planes, which
/// are also written to `keep`.
#[inline(always)]
pub(crate) fn store<S: Simd, T: Sum>(
    simd: S,
    shape: &Shape,
    clip: u8,
    raw: impl Fn(usize, usize) -> [[T; BLOCK]; 2],
    stored: &mut [u8],
    mut keep: Option<&mut [T]>,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            for lane in (0..shape.nodes(0)).step_by(BLOCK) {
                store_block(
                    shape,
                    clip,
                    lane,
                    #[inline(always)]
                    |label| raw(lane, label),
                    stored,
                    keep.as_deref_mut(),
                );
            }
        },
    );
}

/// Goes over all labels twice, because the least cost is known only after the first time. The second time it calls `raw` again,
/// unless the costs were kept.
#[inline(always)]
pub(crate) fn store_block<T: Sum>(
    shape: &Shape,
    clip: u8,
    lane: usize,
    raw: impl Fn(usize) -> [[T; BLOCK]; 2],
    stored: &mut [u8],
    mut keep: Option<&mut [T]>,
) {
    let start = |plane: usize, label: usize| plane * shape.plane() + label * shape.lanes + lane;
    let mut least = [[T::MAX; BLOCK]; 2];
    for label in 0..shape.labels {
        let costs = raw(label);
        for plane in 0..2 {
            for (least, cost) in least[plane].iter_mut().zip(costs[plane]) {
                *least = cost.min(*least);
            }
            if let Some(keep) = &mut keep {
                keep[start(plane, label)..][..BLOCK].copy_from_slice(&costs[plane]);
            }
        }
    }
    for label in 0..shape.labels {
        let costs = match &keep {
            Some(keep) => [0, 1].map(|plane| *block(keep, start(plane, label))),
            None => raw(label),
        };
        for plane in 0..2 {
            let stored = &mut stored[start(plane, label)..][..BLOCK];
            for ((stored, cost), least) in stored.iter_mut().zip(costs[plane]).zip(least[plane]) {
                *stored = (cost - least).clipped(clip);
            }
        }
    }
}

/// A block of lanes.
#[inline(always)]
pub(crate) fn block<T>(lanes: &[T], at: usize) -> &[T; BLOCK] {
    match lanes[at..].first_chunk() {
        Some(block) => block,
        None => panic!("rows are padded to whole blocks"),
    }
}

/// Normalises and clips a strip of nodes whose least costs are known. The unclipped costs are in `kept`, or already in
/// `stored`.
#[inline(always)]
pub(crate) fn normalise<S: Simd>(
    simd: S,
    shape: &Shape,
    strip: Strip,
    clip: u8,
    least: &[u8; STRIP],
    kept: Option<&[u8]>,
    stored: &mut [u8],
) {
    let clip = S::u8s::splat(simd, clip);
    for label in 0..shape.labels {
        let start = label * shape.lanes + strip.first;
        let stored = &mut stored[start..start + strip.lanes];
        let kept = kept.map(|kept| &kept[start..start + strip.lanes]);
        for lane in (0..strip.lanes).step_by(S::u8s::LEN) {
            let range = lane..lane + S::u8s::LEN;
            let raw = S::u8s::from_slice(simd, kept.map_or(&stored[range.clone()], |kept| &kept[range.clone()]));
            let least = S::u8s::from_slice(simd, &least[range.clone()]);
            (raw - least).min(clip).store_slice(&mut stored[range]);
        }
    }
}
