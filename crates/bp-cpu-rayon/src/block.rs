//! Blocks: one value for each of the 32 nodes of a plane in a patch.
//!
//! All costs and messages lie in blocks. A walk over the labels of a vector of nodes is then a walk over consecutive
//! bytes: it fetches whole lines of the cache, and none that the next vector has to fetch again.

use bp_core::Patch;
use fearless_simd::{Simd, SimdBase, u8x32};

/// The nodes of a block: those of one plane in the columns of a patch.
pub(crate) const LANES: usize = Patch::COLUMNS / 2;

/// A block in registers.
pub(crate) type Bytes<S> = u8x32<S>;

/// A value for each node of a block.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(crate) struct Block<T = u8>(pub(crate) [T; LANES]);

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
