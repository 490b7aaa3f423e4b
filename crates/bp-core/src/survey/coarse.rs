//! Window matching of the shrunk pair, in both directions at once: compares each window of census codes with all
//! windows in the corresponding row of the other image.

use std::ops::Range;

use fearless_simd::{Level, Simd, dispatch};
use rayon::prelude::*;

use super::shrink::LONGEST_SIDE;
use crate::{DisparityMap, Error, Size, StereoPair, census, finish, memory};

/// Half the side of a window: the costs of 25 pixels add up to at most 200, which fits 8 bits.
const RADIUS: usize = 2;
const SIDE: usize = 2 * RADIUS + 1;

/// Rows that one thread matches together.
const ROWS: usize = 44;

/// The cost of a pixel whose match lies outside the right image: half of the bits differ, as between unrelated pixels.
const OUTSIDE: u8 = 4;

/// Greater than the cost of any window.
const IMPOSSIBLE: u8 = u8::MAX;

/// Connected matches that cover less than `1 / SPECK` of the pixels are a speck.
const SPECK: usize = 400;

/// Fewer connected matches than this are always a speck.
const LEAST_PATCH: usize = 16;

/// Column, row and disparity of a match.
pub(super) type Found = (usize, usize, i32);

/// Reliable matches of the small left image.
pub(super) struct Matches {
    /// The matches of row y of the left image were searched for in row `y + rows_down` of the right image.
    pub(super) rows_down: isize,
    /// Disparities in small pixels.
    map: DisparityMap,
}

impl Matches {
    /// How many pixels have a match.
    pub(super) fn count(&self) -> usize {
        self.found().count()
    }

    /// The share of pixels that have a match, from 0 to 1.
    pub(super) fn share(&self) -> f64 {
        self.count() as f64 / self.map.size().pixels() as f64
    }

    /// The width of the small images.
    pub(super) fn width(&self) -> usize {
        self.map.size().width
    }

    /// Every pixel that has a match.
    pub(super) fn found(&self) -> impl Iterator<Item = Found> {
        let width = self.width();
        let known = self.map.values().iter().enumerate().filter(|(_, disparity)| disparity.is_finite());
        known.map(move |(i, &disparity)| (i % width, i / width, disparity as i32))
    }
}

/// Matches a small pair.
pub(super) fn find(small: &StereoPair, rows_down: isize) -> Result<Matches, Error> {
    let (size, level) = (small.size(), Level::new());
    debug_assert!(size.width <= LONGEST_SIDE);
    let codes = |image| census::codes(image, 0..size.width, 0..size.height);
    let codes = [codes(small.left()), codes(small.right())];
    let mut disparities = memory::filled("coarse matches", size.pixels(), DisparityMap::UNKNOWN)?;
    disparities.par_chunks_mut(ROWS * size.width).enumerate().try_for_each(|(part, disparities)| {
        let mut search = Search::new(size, &codes, rows_down)?;
        dispatch!(level, simd => search.match_rows(simd, ROWS * part, disparities));
        Ok(())
    })?;
    let map = DisparityMap::new(size, disparities)?;
    let map = finish::remove_speckles(map, (size.pixels() / SPECK).max(LEAST_PATCH))?;
    Ok(Matches { rows_down, map })
}

/// The costs of some rows, and buffers for the results of one. Index `reach + d` is disparity d.
struct Search<'a> {
    size: Size,
    /// Codes of both images, `[height][width]`.
    codes: &'a [Vec<u8>; 2],
    rows_down: isize,
    reach: usize,
    /// Costs of a row before they are summed along it, with [`RADIUS`] more columns on both sides.
    costs: Vec<u8>,
    /// Costs summed along rows, `[row mod SIDE][disparity][width]`.
    strips: Vec<u8>,
    /// Costs of the windows of one row, `[disparity][width]`.
    windows: Vec<u8>,
    left: Best,
    right: Best,
    second: Vec<u8>,
}

impl<'a> Search<'a> {
    fn new(size: Size, codes: &'a [Vec<u8>; 2], rows_down: isize) -> Result<Self, Error> {
        let width = size.width;
        let reach = width / 2;
        let strip = (2 * reach + 1) * width;
        Ok(Self {
            size,
            codes,
            rows_down,
            reach,
            costs: vec![OUTSIDE; width + 2 * RADIUS],
            strips: memory::filled("coarse costs", SIDE * strip, 0)?,
            windows: memory::filled("coarse costs", strip, 0)?,
            left: Best::new(width),
            right: Best::new(width),
            second: vec![IMPOSSIBLE; width],
        })
    }

    /// Fills some rows, from row `first` on, with the matches that are distinct and agree in both directions.
    #[inline(always)]
    fn match_rows<S: Simd>(&mut self, simd: S, first: usize, disparities: &mut [f32]) {
        simd.vectorize(
            #[inline(always)]
            || {
                (first..first + 2 * RADIUS).for_each(|coming| self.enter(coming));
                for (y, row) in (first..).zip(disparities.chunks_exact_mut(self.size.width)) {
                    self.enter(y + 2 * RADIUS);
                    self.find_best();
                    self.find_second();
                    self.write_distinct(row);
                    self.leave(y);
                }
            },
        );
    }

    /// The columns of left pixels whose match at disparity `index` is inside the right image, and of these matches.
    #[inline(always)]
    fn columns(&self, index: usize) -> [Range<usize>; 2] {
        let end = (self.size.width + index).saturating_sub(self.reach).min(self.size.width);
        let left = index.saturating_sub(self.reach)..end;
        let start = self.reach.saturating_sub(index);
        let right = start..start + left.len();
        [left, right]
    }

    /// Adds row `coming - RADIUS` to the windows. Border rows are repeated outward.
    #[inline(always)]
    fn enter(&mut self, coming: usize) {
        let Size { width, height } = self.size;
        let y = coming.saturating_sub(RADIUS).min(height - 1);
        let below = y.saturating_add_signed(self.rows_down).min(height - 1);
        let [left, right] = [(0, y), (1, below)].map(|(image, y)| &self.codes[image][y * width..][..width]);
        let strips = (coming % SIDE) * self.windows.len();
        for index in 0..=2 * self.reach {
            let [from, to] = self.columns(index);
            self.costs.fill(OUTSIDE);
            let pairs = left[from.clone()].iter().zip(&right[to]);
            for (cost, (a, b)) in self.costs[RADIUS + from.start..].iter_mut().zip(pairs) {
                *cost = (a ^ b).count_ones() as u8;
            }
            let strip = &mut self.strips[strips + index * width..][..width];
            let windows = &mut self.windows[index * width..][..width];
            let [a, b, c, d, e] = [0, 1, 2, 3, 4].map(|shift| &self.costs[shift..shift + width]);
            for x in 0..width {
                let sum = a[x] + b[x] + c[x] + d[x] + e[x];
                strip[x] = sum;
                windows[x] += sum;
            }
        }
    }

    /// Removes the row that entered first.
    #[inline(always)]
    fn leave(&mut self, entered: usize) {
        let row = self.windows.len();
        let strips = &self.strips[(entered % SIDE) * row..][..row];
        self.windows.iter_mut().zip(strips).for_each(|(sum, strip)| *sum -= strip);
    }

    /// Finds the best match of each pixel of both images.
    #[inline(always)]
    fn find_best(&mut self) {
        self.left.clear();
        self.right.clear();
        for (index, windows) in self.windows.chunks_exact(self.size.width).enumerate() {
            let [from, to] = self.columns(index);
            self.left.take(from.clone(), &windows[from.clone()], index as u8);
            self.right.take(to, &windows[from], index as u8);
        }
    }

    /// Finds the least cost of each left pixel at disparities that are not adjacent to its best one.
    #[inline(always)]
    fn find_second(&mut self) {
        self.second.fill(IMPOSSIBLE);
        for (index, windows) in self.windows.chunks_exact(self.size.width).enumerate() {
            let [from, _] = self.columns(index);
            let best = &self.left.index[from.clone()];
            for ((second, &cost), best) in self.second[from.clone()].iter_mut().zip(&windows[from]).zip(best) {
                let other = if best.abs_diff(index as u8) > 1 { cost } else { IMPOSSIBLE };
                *second = other.min(*second);
            }
        }
    }

    /// Writes the matches that are distinct and agree in both directions.
    #[inline(always)]
    fn write_distinct(&self, matches: &mut [f32]) {
        for (x, found) in matches.iter_mut().enumerate() {
            let disparity = i16::from(self.left.index[x]) - self.reach as i16;
            let back = self.right.index[(x as i16 - disparity) as usize];
            let (best, second) = (u16::from(self.left.cost[x]), u16::from(self.second[x]));
            let distinct = second != u16::from(IMPOSSIBLE) && 10 * second > 11 * best;
            if distinct && back.abs_diff(self.left.index[x]) <= 1 {
                *found = f32::from(disparity);
            }
        }
    }
}

/// The best match of every pixel of a row so far.
struct Best {
    cost: Vec<u8>,
    index: Vec<u8>,
}

impl Best {
    fn new(width: usize) -> Self {
        Self { cost: vec![IMPOSSIBLE; width], index: vec![0; width] }
    }

    #[inline(always)]
    fn clear(&mut self) {
        self.cost.fill(IMPOSSIBLE);
    }

    /// Updates the pixels whose cost is lower at disparity `index`.
    #[inline(always)]
    fn take(&mut self, columns: Range<usize>, costs: &[u8], index: u8) {
        let best = self.cost[columns.clone()].iter_mut().zip(&mut self.index[columns]);
        for ((least, best), &cost) in best.zip(costs) {
            *best = if cost < *least { index } else { *best };
            *least = cost.min(*least);
        }
    }
}
