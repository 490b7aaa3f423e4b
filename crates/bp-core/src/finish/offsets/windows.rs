//! Variances of grey differences in windows, from sums that rows enter and leave.

use std::ops::RangeInclusive;

use fearless_simd::{Simd, SimdBase};

use super::{
    REACH, SIDE, STEPS, TRIED,
    best::write_best,
    compared::{LANES, UNIT, differences, first_steps, interpolate},
};
use crate::{Error, StereoPair, memory::Buffer};

/// The columns that interpolation reads beyond the left and right border.
const BORDER: [usize; 2] = [1, 2];

/// The differences in the rows of windows whose centres lie in one row.
pub(super) struct Windows {
    width: usize,
    /// The width, rounded up to a multiple of [`LANES`].
    columns: usize,
    /// How many rows there are.
    rows: usize,
    /// The grey values of a row of the left image, in [`UNIT`]s.
    left: Buffer<i16>,
    /// Those of the right image, whose borders are repeated outward by [`BORDER`].
    greys: Buffer<u8>,
    /// The right image's row in steps.
    right: Buffer<i16>,
    /// See [`first_steps`]; `[row mod 7][column]`.
    first: Buffer<i32>,
    /// Grey differences in [`UNIT`]s, `[row mod 7][step][column]`. Rows have [`REACH`] more columns on both sides, with zeros.
    differences: Buffer<i16>,
    /// Sums of the differences in each column, and of their squares, `[step][column]`.
    sums: Buffer<i32>,
    squares: Buffer<i32>,
    /// The variances in the windows around a row, times their pixels, `[step][column]`.
    variances: Buffer<f32>,
}

impl Windows {
    pub(super) fn new(width: usize) -> Result<Self, Error> {
        let (what, columns) = ("grey differences", width.next_multiple_of(LANES));
        let all = all(columns);
        Ok(Self {
            width,
            columns,
            rows: 0,
            left: Buffer::filled(what, columns, 0)?,
            greys: Buffer::filled(what, BORDER[0] + width + BORDER[1], 0)?,
            right: Buffer::filled(what, STEPS * columns, 0)?,
            first: Buffer::filled(what, SIDE * columns, 0)?,
            differences: Buffer::filled(what, SIDE * all, 0)?,
            sums: Buffer::filled(what, all, 0)?,
            squares: Buffer::filled(what, all, 0)?,
            variances: Buffer::filled(what, TRIED * width, 0.0)?,
        })
    }

    /// The bytes that they take for rows of this width.
    pub(super) fn bytes(width: usize) -> u64 {
        let columns = width.next_multiple_of(LANES);
        let of = |len: usize, bytes: usize| len as u64 * bytes as u64;
        let (first, sums) = (of(SIDE * columns, 4), of(2 * all(columns), 4));
        let in_16_bits = of((1 + STEPS) * columns + SIDE * all(columns), 2);
        of(BORDER[0] + width + BORDER[1], 1) + in_16_bits + first + sums + of(TRIED * width, 4)
    }

    /// Adds row y, which has these disparities.
    #[inline(always)]
    pub(super) fn enter<S: Simd>(&mut self, simd: S, pair: &StereoPair, y: usize, disparities: &[f32]) {
        self.rows += 1;
        simd.vectorize(
            #[inline(always)]
            || {
                self.read_greys(pair, y);
                interpolate(&self.greys, &mut self.right[..STEPS * self.width]);
                first_steps(simd, disparities, &mut self.first[(y % SIDE) * self.columns..][..self.columns]);
                self.compare(simd, y);
                self.add::<1>(y);
            },
        );
    }

    /// Removes row y.
    #[inline(always)]
    pub(super) fn leave<S: Simd>(&mut self, simd: S, y: usize) {
        self.rows -= 1;
        simd.vectorize(
            #[inline(always)]
            || self.add::<-1>(y),
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
        let (all, wide) = (all(self.columns), wide(self.columns));
        let row = &mut self.differences[(y % SIDE) * all..][..all];
        let (first, _) = self.first[(y % SIDE) * self.columns..][..self.columns].as_chunks::<LANES>();
        for ((x, first), left) in (REACH..).step_by(LANES).zip(first).zip(self.left.chunks_exact(LANES)) {
            let differences = differences(simd, left, first, &self.right);
            for (tried, difference) in differences.iter().enumerate() {
                difference.store_slice(&mut row[tried * wide + x..][..LANES]);
            }
        }
    }

    #[inline(always)]
    fn add<const SIGN: i32>(&mut self, y: usize) {
        let all = all(self.columns);
        let row = &self.differences[(y % SIDE) * all..][..all];
        for ((&difference, sum), square) in row.iter().zip(&mut self.sums).zip(&mut self.squares) {
            let difference = i32::from(difference);
            *sum += SIGN * difference;
            *square += SIGN * difference * difference;
        }
    }

    /// Writes the refined disparities of row y, which is in the middle.
    #[inline(always)]
    pub(super) fn refine<S: Simd>(
        &mut self,
        simd: S,
        y: usize,
        disparities: &[f32],
        limits: &RangeInclusive<f32>,
        refined: &mut [f32],
    ) {
        simd.vectorize(
            #[inline(always)]
            || {
                self.write_variances();
                let first = &self.first[(y % SIDE) * self.columns..][..self.width];
                write_best(&self.variances, first, disparities, limits, refined);
            },
        );
    }

    #[inline(always)]
    fn write_variances(&mut self) {
        let (width, wide, rows) = (self.width, wide(self.columns), self.rows as f32);
        // A product takes less time than a quotient.
        let shared = 1.0 / (rows * SIDE as f32);
        for (step, variances) in self.variances.chunks_exact_mut(width).enumerate() {
            let [sums, squares] = [&self.sums, &self.squares].map(|all| &all[step * wide..][..wide]);
            let windows = sums.windows(SIDE).zip(squares.windows(SIDE));
            for (variance, (sums, squares)) in variances.iter_mut().zip(windows) {
                let [sum, square] = [sums, squares].map(|values| values.iter().sum::<i32>() as f32);
                *variance = square - sum * sum * shared;
            }
            // The windows at the borders have fewer columns.
            for x in (0..REACH.min(width)).chain(width.saturating_sub(REACH).max(REACH.min(width))..width) {
                let columns = width.min(x + REACH + 1) - x.saturating_sub(REACH);
                let [sum, square] = [sums, squares].map(|all| all[x..x + SIDE].iter().sum::<i32>() as f32);
                variances[x] = square - sum * sum / (rows * columns as f32);
            }
        }
    }
}

/// A row of sums for one tried disparity: columns, and [`REACH`] more on both sides.
fn wide(columns: usize) -> usize {
    columns + 2 * REACH
}

/// Such rows for all of them.
fn all(columns: usize) -> usize {
    TRIED * wide(columns)
}
