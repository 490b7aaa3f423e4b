//! The variances at the tried disparities of each pixel.

use std::ops::RangeInclusive;

use fearless_simd::{Simd, SimdBase};

use super::{
    STEPS, TRIED,
    best::write_best,
    compared::{UNIT, differences, first_steps, interpolate},
};
use crate::{
    Error, Size, StereoPair,
    finish::variances::{LANES, SIDE, Variances},
    memory::Buffer,
};

/// The columns that interpolation reads beyond the left and right border.
const BORDER: [usize; 2] = [1, 2];

/// The rows of windows whose centres lie in one row.
pub(super) struct Windows {
    width: usize,
    /// The width, rounded up to a multiple of [`LANES`].
    columns: usize,
    /// The grey values of a row of the left image, in [`UNIT`]s.
    left: Buffer<i16>,
    /// Those of the right image, whose borders are repeated outward by [`BORDER`].
    greys: Buffer<u8>,
    /// The right image's row in steps.
    right: Buffer<i16>,
    /// See [`first_steps`]; `[row mod 7][column]`.
    first: Buffer<i32>,
    /// Of grey differences in [`UNIT`]s.
    variances: Variances,
    /// The least ones of each pixel of the row that was refined last.
    least: Buffer<f32>,
}

impl Windows {
    pub(super) fn new(size: Size) -> Result<Self, Error> {
        let (what, width) = ("grey differences", size.width);
        let columns = width.next_multiple_of(LANES);
        Ok(Self {
            width,
            columns,
            left: Buffer::filled(what, columns, 0)?,
            greys: Buffer::filled(what, BORDER[0] + width + BORDER[1], 0)?,
            right: Buffer::filled(what, STEPS * columns, 0)?,
            first: Buffer::filled(what, SIDE * columns, 0)?,
            variances: Variances::new(size, TRIED)?,
            least: Buffer::filled(what, width, 0.0)?,
        })
    }

    /// The bytes that they take for rows of this width.
    pub(super) fn bytes(width: usize) -> u64 {
        let columns = width.next_multiple_of(LANES);
        let of = |len: usize, bytes: usize| len as u64 * bytes as u64;
        let rows =
            of(BORDER[0] + width + BORDER[1], 1) + of((1 + STEPS) * columns, 2) + of(SIDE * columns, 4) + of(width, 4);
        rows + Variances::bytes(width, TRIED)
    }

    /// Adds row y, which has these disparities.
    #[inline(always)]
    pub(super) fn enter<S: Simd>(&mut self, simd: S, pair: &StereoPair, y: usize, disparities: &[f32]) {
        simd.vectorize(
            #[inline(always)]
            || {
                self.read_greys(pair, y);
                interpolate(&self.greys, &mut self.right[..STEPS * self.width]);
                first_steps(simd, disparities, &mut self.first[(y % SIDE) * self.columns..][..self.columns]);
                self.compare(simd, y);
                self.variances.enter(y);
            },
        );
    }

    /// Removes row y.
    #[inline(always)]
    pub(super) fn leave<S: Simd>(&mut self, simd: S, y: usize) {
        simd.vectorize(
            #[inline(always)]
            || self.variances.leave(y),
        );
    }

    /// Reads the grey values of row y.
    #[inline(always)]
    fn read_greys(&mut self, pair: &StereoPair, y: usize) {
        let [left, right] = [pair.left(), pair.right()].map(|image| &image.greys()[y * self.width..][..self.width]);
        self.left.iter_mut().zip(left).for_each(|(out, &grey)| *out = UNIT * i16::from(grey));
        let (before, greys) = self.greys.split_at_mut(BORDER[0]);
        let (greys, after) = greys.split_at_mut(self.width);
        greys.copy_from_slice(right);
        before.fill(greys[0]);
        after.fill(greys[self.width - 1]);
    }

    /// Writes the differences of row y.
    #[inline(always)]
    fn compare<S: Simd>(&mut self, simd: S, y: usize) {
        let (first, _) = self.first[(y % SIDE) * self.columns..][..self.columns].as_chunks::<LANES>();
        let mut rows = self.variances.entering_mut();
        let mut rows: [&mut [i16]; TRIED] = std::array::from_fn(|_| rows.next().unwrap_or_default());
        for ((x, first), left) in (0..).step_by(LANES).zip(first).zip(self.left.chunks_exact(LANES)) {
            let differences = differences(simd, left, first, &self.right);
            for (row, difference) in rows.iter_mut().zip(&differences) {
                difference.store_slice(&mut row[x..][..LANES]);
            }
        }
    }

    /// Writes the refined disparities of row y, which is in the middle. Returns the variances there.
    #[inline(always)]
    pub(super) fn refine<S: Simd>(
        &mut self,
        simd: S,
        y: usize,
        disparities: &[f32],
        limits: &RangeInclusive<f32>,
        refined: &mut [f32],
    ) -> &[f32] {
        simd.vectorize(
            #[inline(always)]
            || {
                let first = &self.first[(y % SIDE) * self.columns..][..self.width];
                write_best(self.variances.compute(y), first, disparities, limits, refined, &mut self.least);
                &*self.least
            },
        )
    }
}
