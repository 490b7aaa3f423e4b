//! Data costs of blocks, summed over the pixels that a node covers: one on grid 0, up to four on grid 1.
//!
//! In the terms of `bp-cpu-scalar`, the kernel computes for every node and each label d of its list:
//!
//! ```text
//! raw(d) = sum over its pixels (x, y) of D(left(x, y), right(x - disparity(d), y)), or the out-of-range cost
//! ```

use std::array;

use fearless_simd::{Simd, SimdBase, dispatch};

use super::block::{Block, Bytes, LANES};
use crate::{
    compare::compare_by,
    match_cost::{Matching, channels},
    shape::{BLOCK, BlockStart},
};

/// Pixels of one plane in `ROWS` rows of a block, and the rows of the right image that they match.
struct Pixels<'a, S: Simd, const CHANNELS: usize, const ROWS: usize> {
    plane: usize,
    left: [[Bytes<S>; CHANNELS]; ROWS],
    /// By parity of the column, from a block before lane 0 on.
    right: [[[&'a [u8]; CHANNELS]; ROWS]; 2],
    /// 255 where the left image has a column, otherwise 0.
    exist: Bytes<S>,
}

impl Matching<'_> {
    /// Writes the unclipped costs of a block of pixels in row y, for these labels.
    pub(super) fn pixels(&self, at: BlockStart, y: usize, labels: &[u16], costs: &mut [Block]) {
        dispatch!(self.level, simd => self.sums::<_, 1, 1>(simd, [at.plane], at.lane, y, labels, costs));
    }

    /// Writes the sums of the unclipped costs of the pixels in these lanes of both planes, in row y and the next one, if there
    /// is one.
    pub(super) fn squares(&self, lane: usize, y: usize, labels: &[u16], costs: &mut [Block]) {
        if y + 1 < self.layout.size.height {
            dispatch!(self.level, simd => self.sums::<_, 2, 2>(simd, [0, 1], lane, y, labels, costs));
        } else {
            dispatch!(self.level, simd => self.sums::<_, 2, 1>(simd, [0, 1], lane, y, labels, costs));
        }
    }

    #[inline(always)]
    fn sums<S: Simd, const PLANES: usize, const ROWS: usize>(
        &self,
        simd: S,
        planes: [usize; PLANES],
        lane: usize,
        y: usize,
        labels: &[u16],
        costs: &mut [Block],
    ) {
        let profile = self.plan.model().profile();
        compare_by!(profile, Bytes<S>, self.sums_by(simd, planes, Rows::<ROWS> { lane, y }, labels, costs));
    }

    #[inline(always)]
    fn sums_by<S: Simd, const PLANES: usize, const ROWS: usize, const CHANNELS: usize>(
        &self,
        simd: S,
        planes: [usize; PLANES],
        Rows { lane, y }: Rows<ROWS>,
        labels: &[u16],
        costs: &mut [Block],
        cost: impl Fn([Bytes<S>; CHANNELS], [Bytes<S>; CHANNELS]) -> Bytes<S>,
    ) {
        let outside = Bytes::<S>::splat(simd, self.plan.model().profile().out_of_range_cost() as u8);
        let load = |lanes: &[u8], at: usize| Bytes::<S>::from_slice(simd, &lanes[at..at + LANES]);
        let pixels = planes.map(|plane| self.pixels_of::<S, CHANNELS, ROWS>(simd, plane, lane, y));
        let inside = [0, 1].map(|parity| self.features.inside(parity));
        // Left column 2i + plane matches right column 2i + plane - d, which is lane i + (plane - d) div 2.
        let (first, min, before) = (lane as i32, self.plan.model().min_disparity(), BLOCK as i32);
        let nodes = [0, 1].map(|parity| self.layout.nodes(parity) as i32);
        for (&label, out) in labels.iter().zip(costs) {
            let mut sum = Bytes::<S>::splat(simd, 0);
            for Pixels { plane, left, right, exist } in &pixels {
                let shift = *plane as i32 - min - i32::from(label);
                let parity = (shift & 1) as usize;
                let start = first + (shift >> 1);
                let is_inside = start >= 0 && start + LANES as i32 <= nodes[parity];
                let start = (start.clamp(-before, nodes[parity]) + before) as usize;
                for row in 0..ROWS {
                    let mut cost = cost(left[row], right[parity][row].map(|right| load(right, start)));
                    if !is_inside {
                        let inside = load(inside[parity], start);
                        cost = cost & inside | outside & !inside;
                    }
                    sum += cost & *exist;
                }
            }
            out.store(sum);
        }
    }

    #[inline(always)]
    fn pixels_of<S: Simd, const CHANNELS: usize, const ROWS: usize>(
        &self,
        simd: S,
        plane: usize,
        lane: usize,
        y: usize,
    ) -> Pixels<'_, S, CHANNELS, ROWS> {
        let load = |lanes: &[u8], at: usize| Bytes::<S>::from_slice(simd, &lanes[at..at + LANES]);
        let left = |row: usize| channels::<CHANNELS>(|channel| self.features.left(y + row, channel, plane));
        let right = |parity: usize, row: usize| channels(|channel| self.features.right(y + row, channel, parity));
        Pixels {
            plane,
            left: array::from_fn(|row| left(row).map(|left| load(left, lane))),
            right: [0, 1].map(|parity| array::from_fn(|row| right(parity, row))),
            exist: load(self.features.inside(plane), BLOCK + lane),
        }
    }

    /// As [`Matching::fix`], for a block.
    pub(super) fn fix_block(&self, at: BlockStart, y: usize, labels: &[u16], costs: &mut [Block]) {
        let Some(seed) = self.seed else { return };
        for lane in 0..LANES {
            if seed.touches(2 * (at.lane + lane) + at.plane, y) {
                let cost = |&label: &u16| if label.abs_diff(seed.label) <= 1 { 0 } else { self.dear() };
                labels.iter().zip(&mut *costs).for_each(|(label, block)| block.0[lane] = cost(label));
            }
        }
    }
}

/// `ROWS` rows of a block: its first lane, and the first of the rows.
#[derive(Clone, Copy)]
struct Rows<const ROWS: usize> {
    lane: usize,
    y: usize,
}
