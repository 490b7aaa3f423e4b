//! The search: costs of windows, in vectors of columns, for all disparities.

use std::array;

use fearless_simd::{Select, Simd, SimdBase, SimdInt};

use crate::{Error, Size, memory::Buffer};

/// Half the side of a window: the costs of 25 pixels add up to at most 200, which fits 8 bits.
const RADIUS: usize = 2;
const SIDE: usize = 2 * RADIUS + 1;

/// The cost of a pixel whose match lies outside the right image: half of the bits differ, as between unrelated pixels.
const OUTSIDE: u8 = 4;

/// Greater than the cost of any window.
const IMPOSSIBLE: u8 = u8::MAX;

/// The most columns that are searched together. Rows are rounded up to this.
const MOST_LANES: usize = 64;

/// The costs of some rows, and buffers for the results of one. Index `reach + d` is disparity d.
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
        let (reach, wide) = (size.width / 2, size.width.next_multiple_of(MOST_LANES));
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
                    for column in (0..self.size.width).step_by(S::u8s::LEN) {
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
        // Slices of one known length let the compiler drop most bounds checks in the loops.
        let columns = width.next_multiple_of(S::u8s::LEN);
        let [left, own_inside] = [&self.left_codes[..columns], &self.inside[self.reach..][..columns]];
        // Two walks: sums need costs on both sides, which would not be at hand yet if they had just been stored.
        for (index, costs) in self.pixels.chunks_exact_mut(self.wide + 2 * RADIUS).enumerate() {
            let shift = 2 * self.reach - index;
            let [right, inside] = [&self.right_codes, &self.inside].map(|all| &all[shift..][..columns]);
            let costs = &mut costs[RADIUS..][..columns];
            for column in (0..columns).step_by(S::u8s::LEN) {
                let differing = load(simd, left, column) ^ load(simd, right, column);
                let inside = load(simd, own_inside, column) & load(simd, inside, column);
                let cost = differing.count_ones() & inside | S::u8s::splat(simd, OUTSIDE) & !inside;
                cost.store_slice(&mut costs[column..column + S::u8s::LEN]);
            }
        }
        let windows = self.windows[self.reach..].chunks_exact_mut(self.wide);
        let strips = self.strips[strips].chunks_exact_mut(self.wide);
        for ((costs, strips), windows) in self.pixels.chunks_exact(self.wide + 2 * RADIUS).zip(strips).zip(windows) {
            let shifted: [_; SIDE] = array::from_fn(|shift| &costs[shift..][..columns]);
            let (strips, windows) = (&mut strips[..columns], &mut windows[..columns]);
            for column in (0..columns).step_by(S::u8s::LEN) {
                let mut sum = S::u8s::splat(simd, 0);
                for costs in shifted {
                    sum += load(simd, costs, column);
                }
                let window = load(simd, windows, column) - load(simd, strips, column) + sum;
                window.store_slice(&mut windows[column..column + S::u8s::LEN]);
                sum.store_slice(&mut strips[column..column + S::u8s::LEN]);
            }
        }
    }

    /// Finds the best disparities of left pixels from `column` on, and their least costs elsewhere. A disparity is impossible where the
    /// right pixel would lie outside.
    #[inline(always)]
    fn find_left<S: Simd>(&mut self, simd: S, column: usize) {
        let [none, most, one] = [0, IMPOSSIBLE, 1].map(|value| S::u8s::splat(simd, value));
        let (mut best, mut least, mut second) = (none, most, most);
        // The costs of the disparity before, and the least of all disparities before that.
        let (mut adjacent, mut before) = (most, most);
        // The right pixel of the first disparity lies farthest right.
        let inside = self.inside[column..column + 2 * self.reach + S::u8s::LEN].windows(S::u8s::LEN).rev();
        let windows = self.windows[self.reach..].chunks_exact(self.wide);
        for ((costs, inside), index) in windows.zip(inside).zip(0..) {
            let costs = load(simd, costs, column) | !load(simd, inside, 0);
            let index = S::u8s::splat(simd, index);
            let (is_better, is_next) = (costs.simd_lt(least), index.simd_eq(best + one));
            second = is_better.select(before, is_next.select(second, second.min(costs)));
            best = is_better.select(index, best);
            least = least.min(costs);
            (adjacent, before) = (costs, before.min(adjacent));
        }
        best.store_slice(&mut self.left[column..][..S::u8s::LEN]);
        least.store_slice(&mut self.least[column..][..S::u8s::LEN]);
        second.store_slice(&mut self.second[column..][..S::u8s::LEN]);
    }

    /// Finds the best disparities of right pixels from `column` on. A disparity is impossible where the left pixel would lie outside.
    #[inline(always)]
    fn find_right<S: Simd>(&mut self, simd: S, column: usize) {
        let (mut best, mut least) = (S::u8s::splat(simd, 0), S::u8s::splat(simd, IMPOSSIBLE));
        let inside = self.inside[column..column + 2 * self.reach + S::u8s::LEN].windows(S::u8s::LEN);
        // Right column x matches left column x + index - reach, one farther for each disparity.
        let windows = self.windows[column..].chunks(self.wide + 1);
        for ((costs, inside), index) in windows.zip(inside).zip(0..) {
            let costs = load(simd, costs, 0) | !load(simd, inside, 0);
            best = costs.simd_lt(least).select(S::u8s::splat(simd, index), best);
            least = least.min(costs);
        }
        best.store_slice(&mut self.right[column..][..S::u8s::LEN]);
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
fn load<S: Simd>(simd: S, values: &[u8], at: usize) -> S::u8s {
    S::u8s::from_slice(simd, &values[at..at + S::u8s::LEN])
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;
    use crate::DisparityMap;

    /// Images of noise, the right one shifted by 3 in the upper rows and by -2 in the lower ones.
    fn codes(size: Size) -> [Vec<u8>; 2] {
        let code = |x: usize, y: usize| (x * x * 29 + x * y * 5 + y * 71) as u8;
        let shift = |y: usize| if y < size.height / 2 { 5 } else { 0 };
        let view =
            |shift: &dyn Fn(usize) -> usize| size.nodes().map(|node| code(node.x + shift(node.y), node.y)).collect();
        [view(&|_| 2), view(&shift)]
    }

    /// The costs of the window around a pixel of the left image, by disparity.
    fn window(size: Size, [left, right]: &[Vec<u8>; 2], rows_down: isize, x: usize, y: usize) -> Vec<u32> {
        let (reach, inside) = ((size.width / 2) as isize, 0..size.width as isize);
        let near = |y: isize| y.clamp(0, size.height as isize - 1) as usize;
        let cost = |x: isize, y: usize, disparity: isize| {
            if !inside.contains(&x) || !inside.contains(&(x - disparity)) {
                return OUTSIDE.into();
            }
            let below = near(y as isize + rows_down);
            (left[y * size.width + x as usize] ^ right[below * size.width + (x - disparity) as usize]).count_ones()
        };
        let around = |i: usize| (i as isize - RADIUS as isize)..=(i + RADIUS) as isize;
        let of = |disparity: isize| {
            let row = |y: isize| around(x).map(|x| cost(x, near(y), disparity)).sum::<u32>();
            let sum = around(y).map(row).sum();
            if inside.contains(&(x as isize - disparity)) { sum } else { IMPOSSIBLE.into() }
        };
        (-reach..=reach).map(of).collect()
    }

    fn first_least(costs: impl Iterator<Item = u32>) -> (usize, u32) {
        costs.enumerate().min_by_key(|&(_, cost)| cost).unwrap()
    }

    /// The matches of a row, pixel by pixel.
    fn expected(size: Size, codes: &[Vec<u8>; 2], rows_down: isize, y: usize) -> Vec<f32> {
        let reach = size.width / 2;
        let windows: Vec<_> = (0..size.width).map(|x| window(size, codes, rows_down, x, y)).collect();
        let of_right = |x: usize| {
            let cost =
                |index: usize| (x + index).checked_sub(reach).and_then(|left| windows.get(left)?.get(index).copied());
            first_least((0..=2 * reach).map(|index| cost(index).unwrap_or(IMPOSSIBLE.into()))).0
        };
        let of_left = |(x, costs): (usize, &Vec<u32>)| {
            let (best, least) = first_least(costs.iter().copied());
            let others = costs.iter().enumerate().filter(|&(index, _)| index.abs_diff(best) > 1);
            let second = others.map(|(_, &cost)| cost).min().unwrap_or(IMPOSSIBLE.into());
            let distinct = second != IMPOSSIBLE.into() && 10 * second > 11 * least;
            let agrees = distinct && of_right(x + reach - best).abs_diff(best) <= 1;
            if agrees { best as f32 - reach as f32 } else { DisparityMap::UNKNOWN }
        };
        windows.iter().enumerate().map(of_left).collect()
    }

    #[test]
    #[cfg_attr(miri, ignore = "takes minutes")]
    fn vectors_find_what_single_pixels_do() {
        for (width, height, rows_down) in [(1, 1, 0), (2, 3, 0), (31, 5, 0), (64, 4, 1), (97, 9, 0), (130, 6, -2)] {
            let size = Size { width, height };
            let codes = codes(size);
            let expected: Vec<_> = (0..height).flat_map(|y| expected(size, &codes, rows_down, y)).collect();
            for level in [Level::new(), Level::baseline()] {
                let mut found = vec![DisparityMap::UNKNOWN; size.pixels()];
                let mut search = Search::new(size, &codes, rows_down).unwrap();
                dispatch!(level, simd => search.match_rows(simd, 0, &mut found));
                assert_eq!(found, expected, "{size}, {rows_down} rows down");
            }
            assert!(width < 31 || rows_down != 0 || expected.iter().filter(|found| found.is_finite()).count() > width);
        }
    }
}
