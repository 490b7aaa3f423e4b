//! Blocks: one value for each of the 32 nodes of a plane in a patch.

use bp_core::Patch;
use fearless_simd::{Simd, SimdBase, u8x32};

/// The nodes of a block: those of one plane in the columns of a patch.
pub(crate) const LANES: usize = Patch::COLUMNS / 2;

/// A block in registers.
pub(crate) type Bytes<S> = u8x32<S>;

/// A byte for each node of a block.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(crate) struct Block(pub(crate) [u8; LANES]);

impl Block {
    pub(crate) const ZERO: Self = Self([0; LANES]);

    #[inline(always)]
    pub(crate) fn load<S: Simd>(&self, simd: S) -> Bytes<S> {
        Bytes::load_array_ref(simd, &self.0)
    }

    #[inline(always)]
    pub(crate) fn store<S: Simd>(&mut self, values: Bytes<S>) {
        values.store_array(&mut self.0);
    }
}

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
