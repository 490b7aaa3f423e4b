//! The search: costs of windows, in vectors of columns, for all disparities.

use fearless_simd::{Select, Simd, SimdBase, SimdInt, u8x32};

use crate::{Error, Size, memory::Buffer};

/// Half the side of a window: the costs of 25 pixels add up to at most 200, which fits 8 bits.
const RADIUS: usize = 2;
const SIDE: usize = 2 * RADIUS + 1;

/// The cost of a pixel whose match lies outside the right image: half of the bits differ, as between unrelated pixels.
const OUTSIDE: u8 = 4;

/// Greater than the cost of any window.
const IMPOSSIBLE: u8 = u8::MAX;

/// Columns that are searched together.
const LANES: usize = 32;
type Bytes<S> = u8x32<S>;

/// The costs of some rows, and buffers for the results of one. Index `reach + d` is disparity d. Rows are rounded up to whole
/// vectors.
pub(super) struct Search<'a> {
    size: Size,
    /// Codes of both images, `[height][width]`.
    codes: &'a [Vec<u8>; 2],
    rows_down: isize,
    reach: usize,
    /// The width, rounded up.
    wide: usize,
    /// 255 at the columns of an image, 0 around them, with `reach` more columns on both sides.
    inside: Buffer<u8>,
    /// Codes of a row of the left image.
    left_codes: Buffer<u8>,
    /// Codes of a row of the right image, with `reach` more columns on both sides.
    right_codes: Buffer<u8>,
    /// Costs of the pixels of a row, `[disparity][column]`, with [`RADIUS`] more columns on both sides.
    pixels: Buffer<u8>,
    /// Costs summed along rows, `[row mod SIDE][disparity][column]`.
    strips: Buffer<u8>,
    /// Costs of the windows of one row, `[disparity][column]`, with `reach` more columns before the first and after the last
    /// disparity.
    windows: Buffer<u8>,
    /// The best disparities of left pixels, `[column]`.
    left: Buffer<u8>,
    /// Their costs.
    least: Buffer<u8>,
    /// The least costs of left pixels at disparities that are not adjacent to the best one.
    second: Buffer<u8>,
    /// The best disparities of right pixels.
    right: Buffer<u8>,
}

impl<'a> Search<'a> {
    pub(super) fn new(size: Size, codes: &'a [Vec<u8>; 2], rows_down: isize) -> Result<Self, Error> {
        let (reach, wide) = (size.width / 2, size.width.next_multiple_of(LANES));
        let disparities = 2 * reach + 1;
        let filled = |len, value| Buffer::filled("coarse costs", len, value);
        let mut inside = filled(wide + 2 * reach, 0)?;
        inside[reach..reach + size.width].fill(u8::MAX);
        Ok(Self {
            size,
            codes,
            rows_down,
            reach,
            wide,
            inside,
            left_codes: filled(wide, 0)?,
            right_codes: filled(wide + 2 * reach, 0)?,
            pixels: filled(disparities * (wide + 2 * RADIUS), OUTSIDE)?,
            strips: filled(SIDE * disparities * wide, 0)?,
            windows: filled(disparities * wide + 2 * reach, 0)?,
            left: filled(wide, 0)?,
            least: filled(wide, 0)?,
            second: filled(wide, 0)?,
            right: filled(wide, 0)?,
        })
    }

    /// Fills some rows, from row `first` on, with the matches that are distinct and agree in both directions.
    #[inline(always)]
    pub(super) fn match_rows<S: Simd>(&mut self, simd: S, first: usize, disparities: &mut [f32]) {
        simd.vectorize(
            #[inline(always)]
            || {
                (first..first + 2 * RADIUS).for_each(|coming| self.enter(simd, coming));
                for (y, row) in (first..).zip(disparities.chunks_exact_mut(self.size.width)) {
                    self.enter(simd, y + 2 * RADIUS);
                    for column in (0..self.wide).step_by(LANES) {
                        self.find_left(simd, column);
                        self.find_right(simd, column);
                    }
                    self.write_distinct(row);
                }
            },
        );
    }

    /// Adds row `coming - RADIUS` to the windows and removes the one [`SIDE`] rows before. Border rows are repeated outward.
    #[inline(always)]
    fn enter<S: Simd>(&mut self, simd: S, coming: usize) {
        let Size { width, height } = self.size;
        let y = coming.saturating_sub(RADIUS).min(height - 1);
        let below = y.saturating_add_signed(self.rows_down).min(height - 1);
        self.left_codes[..width].copy_from_slice(&self.codes[0][y * width..][..width]);
        self.right_codes[self.reach..][..width].copy_from_slice(&self.codes[1][below * width..][..width]);
        let row = (2 * self.reach + 1) * self.wide;
        let strips = (coming % SIDE) * row..(coming % SIDE + 1) * row;
        // Two walks: sums need costs on both sides, which would not be at hand yet if they had just been stored.
        for (index, costs) in self.pixels.chunks_exact_mut(self.wide + 2 * RADIUS).enumerate() {
            let shift = 2 * self.reach - index;
            for column in (0..self.wide).step_by(LANES) {
                let differing = load(simd, &self.left_codes, column) ^ load(simd, &self.right_codes, shift + column);
                let inside = load(simd, &self.inside, self.reach + column) & load(simd, &self.inside, shift + column);
                let cost = differing.count_ones() & inside | Bytes::splat(simd, OUTSIDE) & !inside;
                cost.store_slice(&mut costs[RADIUS + column..][..LANES]);
            }
        }
        let windows = self.windows[self.reach..].chunks_exact_mut(self.wide);
        let strips = self.strips[strips].chunks_exact_mut(self.wide);
        for ((costs, strips), windows) in self.pixels.chunks_exact(self.wide + 2 * RADIUS).zip(strips).zip(windows) {
            for column in (0..self.wide).step_by(LANES) {
                let mut sum = load(simd, costs, column);
                for shift in 1..SIDE {
                    sum += load(simd, costs, column + shift);
                }
                let window = load(simd, windows, column) - load(simd, strips, column) + sum;
                window.store_slice(&mut windows[column..][..LANES]);
                sum.store_slice(&mut strips[column..][..LANES]);
            }
        }
    }

    /// Finds the best disparities of left pixels from `column` on, and their least costs elsewhere.
    #[inline(always)]
    fn find_left<S: Simd>(&mut self, simd: S, column: usize) {
        let last = 2 * self.reach;
        let (best, least) = find_best(
            simd,
            last,
            #[inline(always)]
            |index| self.left_costs(simd, column, index),
        );
        let mut second = Bytes::splat(simd, IMPOSSIBLE);
        for index in 0..=last {
            let costs = self.left_costs(simd, column, index);
            // From 0 to 2 if they are adjacent. No other difference wraps around to that.
            let difference = best - Bytes::splat(simd, index as u8) + Bytes::splat(simd, 1);
            second = difference.simd_lt(Bytes::splat(simd, 3)).select(second, second.min(costs));
        }
        best.store_slice(&mut self.left[column..][..LANES]);
        least.store_slice(&mut self.least[column..][..LANES]);
        second.store_slice(&mut self.second[column..][..LANES]);
    }

    /// Finds the best disparities of right pixels from `column` on.
    #[inline(always)]
    fn find_right<S: Simd>(&mut self, simd: S, column: usize) {
        let (best, _) = find_best(
            simd,
            2 * self.reach,
            #[inline(always)]
            |index| self.right_costs(simd, column, index),
        );
        best.store_slice(&mut self.right[column..][..LANES]);
    }

    /// The costs of left pixels from `column` on; impossible where the right pixel would lie outside.
    #[inline(always)]
    fn left_costs<S: Simd>(&self, simd: S, column: usize, index: usize) -> Bytes<S> {
        let inside = load(simd, &self.inside, 2 * self.reach - index + column);
        load(simd, &self.windows, self.reach + index * self.wide + column) | !inside
    }

    /// The costs of right pixels from `column` on; impossible where the left pixel would lie outside.
    #[inline(always)]
    fn right_costs<S: Simd>(&self, simd: S, column: usize, index: usize) -> Bytes<S> {
        // Right column x matches left column x + index - reach.
        let inside = load(simd, &self.inside, column + index);
        load(simd, &self.windows, index * self.wide + column + index) | !inside
    }

    /// Writes the matches that are distinct and agree in both directions.
    #[inline(always)]
    fn write_distinct(&self, matches: &mut [f32]) {
        for (x, found) in matches.iter_mut().enumerate() {
            let disparity = i16::from(self.left[x]) - self.reach as i16;
            let back = self.right[(x as i16 - disparity) as usize];
            let (best, second) = (u16::from(self.least[x]), u16::from(self.second[x]));
            let distinct = second != u16::from(IMPOSSIBLE) && 10 * second > 11 * best;
            if distinct && back.abs_diff(self.left[x]) <= 1 {
                *found = f32::from(disparity);
            }
        }
    }
}

#[inline(always)]
fn load<S: Simd>(simd: S, values: &[u8], at: usize) -> Bytes<S> {
    Bytes::from_slice(simd, &values[at..at + LANES])
}

/// The first of the best disparities up to `last`, and its cost.
#[inline(always)]
fn find_best<S: Simd>(simd: S, last: usize, cost: impl Fn(usize) -> Bytes<S>) -> (Bytes<S>, Bytes<S>) {
    let (mut best, mut least) = (Bytes::splat(simd, 0), Bytes::splat(simd, IMPOSSIBLE));
    for index in 0..=last {
        let cost = cost(index);
        best = cost.simd_lt(least).select(Bytes::splat(simd, index as u8), best);
        least = least.min(cost);
    }
    (best, least)
}
