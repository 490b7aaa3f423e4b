//! Variances of grey differences in windows, from sums that rows enter and leave.

use std::ops::RangeInclusive;

use fearless_simd::Simd;

use super::{
    REACH, SIDE, STEPS, TRIED,
    best::write_best,
    compared::{UNIT, first_steps, interpolate},
};
use crate::{Error, StereoPair, image::grey, memory};

/// The columns that interpolation reads beyond the left and right border.
const BORDER: [usize; 2] = [1, 2];

/// The differences in the rows of windows whose centres lie in one row.
pub(super) struct Windows {
    width: usize,
    /// How many rows there are.
    rows: usize,
    /// The grey values of a row of the left image, and of the right one, whose borders are repeated outward by [`BORDER`].
    greys: [Vec<u8>; 2],
    /// The right image's row in steps.
    right: Vec<i16>,
    /// See [`first_steps`].
    first: Vec<i32>,
    /// Grey differences in [`UNIT`]s, `[row mod 7][step][column]`. Rows have [`REACH`] more columns on both sides, with zeros.
    differences: Vec<i16>,
    /// Sums of the differences in each column, and of their squares, `[step][column]`.
    sums: Vec<i32>,
    squares: Vec<i32>,
    /// The variances in the windows around a row, times their pixels, `[step][column]`.
    variances: Vec<f32>,
}

impl Windows {
    pub(super) fn new(width: usize) -> Result<Self, Error> {
        let (what, columns) = ("grey differences", TRIED * (width + 2 * REACH));
        Ok(Self {
            width,
            rows: 0,
            greys: [memory::filled(what, width, 0)?, memory::filled(what, BORDER[0] + width + BORDER[1], 0)?],
            right: memory::filled(what, STEPS * width, 0)?,
            first: memory::filled(what, width, 0)?,
            differences: memory::filled(what, SIDE * columns, 0)?,
            sums: memory::filled(what, columns, 0)?,
            squares: memory::filled(what, columns, 0)?,
            variances: memory::filled(what, TRIED * width, 0.0)?,
        })
    }

    /// The bytes that they take for rows of this width.
    pub(super) fn bytes(width: usize) -> u64 {
        let of = |len: usize, bytes: usize| len as u64 * bytes as u64;
        let (columns, steps) = (TRIED * (width + 2 * REACH), STEPS * width);
        let (greys, first, sums) = (of(2 * width + BORDER[0] + BORDER[1], 1), of(width, 4), of(2 * columns, 4));
        greys + first + sums + of(steps + SIDE * columns, 2) + of(TRIED * width, 4)
    }

    fn columns(&self) -> usize {
        TRIED * (self.width + 2 * REACH)
    }

    /// Adds row y, which has these disparities.
    #[inline(always)]
    pub(super) fn enter<S: Simd>(&mut self, simd: S, pair: &StereoPair, y: usize, disparities: &[f32]) {
        self.rows += 1;
        simd.vectorize(
            #[inline(always)]
            || {
                self.read_greys(pair, y);
                interpolate(&self.greys[1], &mut self.right);
                first_steps(disparities, &mut self.first);
                self.compare(y);
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
        let [left, right] = &mut self.greys;
        let inside = BORDER[0]..BORDER[0] + self.width;
        for (greys, image) in [(&mut left[..], pair.left()), (&mut right[inside.clone()], pair.right())] {
            let pixels = &image.pixels()[y * self.width..][..self.width];
            greys.iter_mut().zip(pixels).for_each(|(out, &pixel)| *out = grey(pixel));
        }
        let [first, last] = [right[inside.start], right[inside.end - 1]];
        right[..inside.start].fill(first);
        right[inside.end..].fill(last);
    }

    /// Writes the differences of row y.
    #[inline(always)]
    fn compare(&mut self, y: usize) {
        let (columns, wide) = (self.columns(), self.width + 2 * REACH);
        let row = &mut self.differences[(y % SIDE) * columns..][..columns];
        for (x, (&grey, &first)) in self.greys[0].iter().zip(&self.first).enumerate() {
            let grey = UNIT * i16::from(grey);
            let tried = usize::try_from(first).ok().and_then(|first| self.right.get(first..first + TRIED));
            for step in 0..TRIED {
                // A larger disparity lies farther left.
                let difference = tried.map_or(0, |tried| grey - tried[TRIED - 1 - step]);
                row[step * wide + REACH + x] = difference;
            }
        }
    }

    #[inline(always)]
    fn add<const SIGN: i32>(&mut self, y: usize) {
        let columns = self.columns();
        let row = &self.differences[(y % SIDE) * columns..][..columns];
        for ((&difference, sum), square) in row.iter().zip(&mut self.sums).zip(&mut self.squares) {
            let difference = i32::from(difference);
            *sum += SIGN * difference;
            *square += SIGN * difference * difference;
        }
    }

    /// Writes the refined disparities of the row in the middle.
    #[inline(always)]
    pub(super) fn refine<S: Simd>(
        &mut self,
        simd: S,
        disparities: &[f32],
        limits: &RangeInclusive<f32>,
        refined: &mut [f32],
    ) {
        simd.vectorize(
            #[inline(always)]
            || {
                self.write_variances();
                first_steps(disparities, &mut self.first);
                write_best(&self.variances, &self.first, disparities, limits, refined);
            },
        );
    }

    #[inline(always)]
    fn write_variances(&mut self) {
        let (width, wide, rows) = (self.width, self.width + 2 * REACH, self.rows as f32);
        for (step, variances) in self.variances.chunks_exact_mut(width).enumerate() {
            let [sums, squares] = [&self.sums, &self.squares].map(|all| &all[step * wide..][..wide]);
            let windows = sums.windows(SIDE).zip(squares.windows(SIDE));
            for (variance, (sums, squares)) in variances.iter_mut().zip(windows) {
                let [sum, square] = [sums, squares].map(|values| values.iter().sum::<i32>() as f32);
                *variance = square - sum * sum / (rows * SIDE as f32);
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
