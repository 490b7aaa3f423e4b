//! Window matching of the shrunk pair, from both sides at once: a window of census codes against all others of its row.

use std::ops::Range;

use super::LONGEST_SIDE;
use crate::{Error, StereoPair, census, memory};

/// Half the side of a window: the costs of 25 pixels add up to at most 200, which fits 8 bits.
const RADIUS: usize = 2;

/// What a pixel costs whose match lies outside the right image: half of the bits differ, as between unrelated pixels.
const OUTSIDE: u8 = 4;

/// What no window costs.
const IMPOSSIBLE: u8 = u8::MAX;

/// Connected matches that cover less than one in so many pixels are a speck.
const SPECK: usize = 400;

/// No fewer matches than these are more than a speck.
const LEAST_PATCH: usize = 16;

/// Trustworthy matches of the small left image.
pub(super) struct Matches {
    /// What a left pixel of row y shows was looked for in row `y + rows_down` of the right image.
    pub(super) rows_down: isize,
    width: usize,
    /// Disparities in small pixels `[height][width]`.
    disparities: Vec<Option<i16>>,
}

impl Matches {
    /// How many pixels have a match.
    pub(super) fn count(&self) -> usize {
        self.disparities.iter().flatten().count()
    }

    /// Their share, 0 to 1.
    pub(super) fn share(&self) -> f64 {
        self.count() as f64 / self.disparities.len() as f64
    }

    /// Column, row and disparity of every pixel that has a match.
    pub(super) fn found(&self) -> impl Iterator<Item = (usize, usize, i16)> {
        let place = |(i, disparity): (usize, &Option<i16>)| Some((i % self.width, i / self.width, (*disparity)?));
        self.disparities.iter().enumerate().filter_map(place)
    }
}

/// Matches a small pair.
pub(super) fn find(small: &StereoPair, rows_down: isize) -> Result<Matches, Error> {
    let mut search = Search::new(small, rows_down)?;
    let size = small.size();
    let mut matches = memory::filled("coarse matches", size.pixels(), None)?;
    for (y, row) in matches.chunks_exact_mut(size.width).enumerate() {
        search.match_row(y, row);
    }
    remove_specks(&mut matches, size.width);
    Ok(Matches { rows_down, width: size.width, disparities: matches })
}

/// The costs of a pair, and room for one row of answers. Index `reach + d` stands for disparity d.
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

    /// Columns of left pixels that match inside the right image at disparity `index`, and of the pixels they match.
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
        for y in 0..self.height {
            let codes = |image, y| (0..width).map(|x| census::code(image, x, y)).collect::<Vec<u8>>();
            let below = y.saturating_add_signed(rows_down).min(self.height - 1);
            let (left, right) = (codes(small.left(), y), codes(small.right(), below));
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

    /// Fills a row of matches with those that both sides agree on and that are distinct.
    fn match_row(&mut self, y: usize, matches: &mut [Option<i16>]) {
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
            *found = (distinct && back.abs_diff(self.left.index[x]) <= 1).then_some(disparity);
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

    /// Finds the least cost of each left pixel at disparities that are no neighbours of its best one.
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

    /// Takes what is cheaper at disparity `index`.
    fn take(&mut self, columns: Range<usize>, costs: &[u8], index: u8) {
        let best = self.cost[columns.clone()].iter_mut().zip(&mut self.index[columns]);
        for ((least, best), &cost) in best.zip(costs) {
            *best = if cost < *least { index } else { *best };
            *least = cost.min(*least);
        }
    }
}

/// Sums of the `2 * RADIUS + 1` values from each place on.
fn add_shifted(sums: &mut [u8], values: &[u8]) {
    for shift in 0..=2 * RADIUS {
        sums.iter_mut().zip(&values[shift..]).for_each(|(sum, value)| *sum += value);
    }
}

/// Takes out matches whose neighbours of like disparity, and theirs, are too few to be a surface.
fn remove_specks(matches: &mut [Option<i16>], width: usize) {
    let least = (matches.len() / SPECK).max(LEAST_PATCH);
    let mut seen = vec![false; matches.len()];
    let mut patch = Vec::new();
    for start in 0..matches.len() {
        if seen[start] || matches[start].is_none() {
            continue;
        }
        collect_patch(matches, width, start, &mut seen, &mut patch);
        if patch.len() < least {
            patch.iter().for_each(|&i| matches[i] = None);
        }
    }
}

/// Collects the pixels connected with `start` by steps of at most one disparity.
fn collect_patch(matches: &[Option<i16>], width: usize, start: usize, seen: &mut [bool], patch: &mut Vec<usize>) {
    patch.clear();
    patch.push(start);
    seen[start] = true;
    let mut next = 0;
    while let Some(&i) = patch.get(next) {
        next += 1;
        let (x, here) = (i % width, matches[i]);
        let beside = [(x > 0).then(|| i - 1), (x + 1 < width).then_some(i + 1)];
        let above = [i.checked_sub(width), Some(i + width).filter(|&i| i < matches.len())];
        for other in beside.into_iter().chain(above).flatten() {
            let alike = here.zip(matches[other]).is_some_and(|(a, b)| a.abs_diff(b) <= 1);
            if alike && !seen[other] {
                seen[other] = true;
                patch.push(other);
            }
        }
    }
}
