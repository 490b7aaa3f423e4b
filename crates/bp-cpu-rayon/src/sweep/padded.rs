//! A block together with lanes of its neighbours.

use fearless_simd::{Simd, SimdBase};

use crate::block::{Bytes, LANES};

/// The first lane of a [`Padded`] block.
const PADDING: usize = 8;

/// A block with a few more lanes before and after it. These belong to the patches on its left and right.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub(crate) struct Padded([u8; PADDING + LANES + PADDING]);

impl Padded {
    pub(crate) const ZERO: Self = Self([0; PADDING + LANES + PADDING]);

    /// The 32 lanes from `MOVED` on, from -1 to 1.
    #[inline(always)]
    pub(crate) fn load<S: Simd, const MOVED: isize>(&self, simd: S) -> Bytes<S> {
        let first = const { PADDING.wrapping_add_signed(MOVED) };
        Bytes::from_slice(simd, &self.0[first..first + LANES])
    }

    /// Writes the 32 lanes from `MOVED` on, from -1 to 1.
    #[inline(always)]
    pub(crate) fn store<S: Simd, const MOVED: isize>(&mut self, values: Bytes<S>) {
        let first = const { PADDING.wrapping_add_signed(MOVED) };
        values.store_slice(&mut self.0[first..first + LANES]);
    }

    /// The value of a lane, from -1 to 32.
    #[inline(always)]
    pub(crate) fn lane(&self, lane: isize) -> u8 {
        self.0[PADDING.wrapping_add_signed(lane)]
    }

    /// The same, to be written.
    #[inline(always)]
    pub(crate) fn lane_mut(&mut self, lane: isize) -> &mut u8 {
        &mut self.0[PADDING.wrapping_add_signed(lane)]
    }

    /// 16 lanes from `first` on, from -1 to 17.
    #[inline(always)]
    pub(crate) fn half(&self, first: isize) -> &[u8] {
        &self.0[PADDING.wrapping_add_signed(first)..][..LANES / 2]
    }
}
