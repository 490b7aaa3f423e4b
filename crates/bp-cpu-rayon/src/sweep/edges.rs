//! The smoothness costs of the edges of a block's nodes to three sides, by level; see [`bp_core::EdgeLevels`].
//!
//! Loops are inlined where `map` is not.

use bp_core::EdgeLevels;
use fearless_simd::{Simd, SimdBase};

use crate::{
    block::Bytes,
    greys::{Around, of_levels},
};

/// The levels of the edges of these slots, or the first level if there are no grey values.
#[inline(always)]
pub(super) fn levels<S: Simd>(simd: S, around: Option<Around<'_>>, lane: usize, slots: [usize; 3]) -> [Bytes<S>; 3] {
    let mut levels = [Bytes::splat(simd, 0); 3];
    if let Some(around) = around {
        for (levels, slot) in levels.iter_mut().zip(slots) {
            *levels = around.levels(simd, slot, lane);
        }
    }
    levels
}

/// The value of each lane's level; without `LEVELS`, that of the first level.
#[inline(always)]
pub(super) fn of_edges<S: Simd, const LEVELS: bool>(
    simd: S,
    levels: Bytes<S>,
    values: [u8; EdgeLevels::COUNT],
) -> Bytes<S> {
    if LEVELS { of_levels(simd, levels, values) } else { Bytes::splat(simd, values[0]) }
}

/// As [`of_edges`], for three sides.
#[inline(always)]
pub(super) fn of_sides<S: Simd, const LEVELS: bool>(
    simd: S,
    mut levels: [Bytes<S>; 3],
    values: [u8; EdgeLevels::COUNT],
) -> [Bytes<S>; 3] {
    for levels in &mut levels {
        *levels = of_edges::<S, LEVELS>(simd, *levels, values);
    }
    levels
}
