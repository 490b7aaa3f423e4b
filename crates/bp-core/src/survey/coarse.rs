//! Window matching of the shrunk pair, in both directions at once: compares each window of census codes with all
//! windows in the corresponding row of the other image.

use std::ops::Range;

use super::shrink::LONGEST_SIDE;
use crate::{DisparityMap, Error, StereoPair, census, finish, memory};

/// Half the side of a window: the costs of 25 pixels add up to at most 200, which fits 8 bits.
const RADIUS: usize = 2;

/// The cost of a pixel whose match lies outside the right image: half of the bits differ, as between unrelated pixels.
const OUTSIDE: u8 = 4;

/// Greater than the cost of any window.
const IMPOSSIBLE: u8 = u8::MAX;

/// Connected matches that cover less than `1 / SPECK` of the pixels are a speck.
const SPECK: usize = 400;

/// Fewer connected matches than this are always a speck.
const LEAST_PATCH: usize = 16;

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

    /// Column, row and disparity of every pixel that has a match.
    pub(super) fn found(&self) -> impl Iterator<Item = (usize, usize, i32)> {
        let width = self.map.size().width;
        let known = self.map.values().iter().enumerate().filter(|(_, disparity)| disparity.is_finite());
        known.map(move |(i, &disparity)| (i % width, i / width, disparity as i32))
    }
}

/// Matches a small pair.
pub(super) fn find(small: &StereoPair, rows_down: isize) -> Result<Matches, Error> {
    let mut search = Search::new(small, rows_down)?;
    let size = small.size();
    let mut disparities = memory::filled("coarse matches", size.pixels(), DisparityMap::UNKNOWN)?;
    for (y, row) in disparities.chunks_exact_mut(size.width).enumerate() {
        search.match_row(y, row);
    }
    let map = DisparityMap::new(size, disparities)?;
    let map = finish::remove_speckles(map, (size.pixels() / SPECK).max(LEAST_PATCH))?;
    Ok(Matches { rows_down, map })
}

/// The costs of a pair, and buffers for the results of one row. Index `reach + d` is disparity d.
struct Search {
    width: usize,
    height: usize,
    reach: usize,
    /// Costs summed along rows, `[height][disparity][width]`.
    strips: Vec<u8>,
    /// Costs of the windows of one row, `[disparity][width]`.
    windows: Vec<u8>,
    left: Best,
    right: Best,
    second: Vec<u8>,
}

impl Search {
    fn new(small: &StereoPair, rows_down: isize) -> Result<Self, Error> {
        let (width, height) = (small.size().width, small.size().height);
        debug_assert!(width <= LONGEST_SIDE);
        let reach = width / 2;
        let disparities = 2 * reach + 1;
        let strips = memory::filled("coarse costs", height * disparities * width, 0u8)?;
        let windows = memory::filled("coarse costs", disparities * width, 0u8)?;
        let (left, right, second) = (Best::new(width), Best::new(width), vec![IMPOSSIBLE; width]);
        let mut search = Self { width, height, reach, strips, windows, left, right, second };
        search.fill_strips(small, rows_down);
        Ok(search)
    }

    /// The columns of left pixels whose match at disparity `index` is inside the right image, and of these matches.
    fn columns(&self, index: usize) -> [Range<usize>; 2] {
        let end = (self.width + index).saturating_sub(self.reach).min(self.width);
        let left = index.saturating_sub(self.reach)..end;
        let start = self.reach.saturating_sub(index);
        let right = start..start + left.len();
        [left, right]
    }

    fn fill_strips(&mut self, small: &StereoPair, rows_down: isize) {
        let (width, disparities) = (self.width, 2 * self.reach + 1);
        let mut costs = vec![OUTSIDE; width + 2 * RADIUS];
        let codes = |image| census::codes(image, 0..width, 0..self.height);
        let (left, right) = (codes(small.left()), codes(small.right()));
        for (y, left) in left.chunks_exact(width).enumerate() {
            let below = y.saturating_add_signed(rows_down).min(self.height - 1);
            let right = &right[below * width..(below + 1) * width];
            for index in 0..disparities {
                let [from, to] = self.columns(index);
                costs.fill(OUTSIDE);
                let pairs = left[from.clone()].iter().zip(&right[to]);
                for (cost, (a, b)) in costs[RADIUS + from.start..].iter_mut().zip(pairs) {
                    *cost = (a ^ b).count_ones() as u8;
                }
                let start = (y * disparities + index) * width;
                add_shifted(&mut self.strips[start..start + width], &costs);
            }
        }
    }

    /// Fills a row with the matches that are distinct and agree in both directions.
    fn match_row(&mut self, y: usize, matches: &mut [f32]) {
        self.sum_windows(y);
        self.left.clear();
        self.right.clear();
        for (index, windows) in self.windows.chunks_exact(self.width).enumerate() {
            let [from, to] = self.columns(index);
            self.left.take(from.clone(), &windows[from.clone()], index as u8);
            self.right.take(to, &windows[from], index as u8);
        }
        self.find_second();
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

    /// Adds up the strips of the rows around `y`; border rows are repeated outward.
    fn sum_windows(&mut self, y: usize) {
        let row = self.windows.len();
        self.windows.fill(0);
        for y in (y..=y + 2 * RADIUS).map(|y| y.saturating_sub(RADIUS).min(self.height - 1)) {
            let strips = &self.strips[y * row..(y + 1) * row];
            self.windows.iter_mut().zip(strips).for_each(|(sum, strip)| *sum += strip);
        }
    }

    /// Finds the least cost of each left pixel at disparities that are not adjacent to its best one.
    fn find_second(&mut self) {
        self.second.fill(IMPOSSIBLE);
        for (index, windows) in self.windows.chunks_exact(self.width).enumerate() {
            let [from, _] = self.columns(index);
            let best = &self.left.index[from.clone()];
            for ((second, &cost), best) in self.second[from.clone()].iter_mut().zip(&windows[from]).zip(best) {
                let other = if best.abs_diff(index as u8) > 1 { cost } else { IMPOSSIBLE };
                *second = other.min(*second);
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

    fn clear(&mut self) {
        self.cost.fill(IMPOSSIBLE);
    }

    /// Updates the pixels whose cost is lower at disparity `index`.
    fn take(&mut self, columns: Range<usize>, costs: &[u8], index: u8) {
        let best = self.cost[columns.clone()].iter_mut().zip(&mut self.index[columns]);
        for ((least, best), &cost) in best.zip(costs) {
            *best = if cost < *least { index } else { *best };
            *least = cost.min(*least);
        }
    }
}

/// Adds to each sum the `2 * RADIUS + 1` values that start at its index.
fn add_shifted(sums: &mut [u8], values: &[u8]) {
    for shift in 0..=2 * RADIUS {
        sums.iter_mut().zip(&values[shift..]).for_each(|(sum, value)| *sum += value);
    }
}
