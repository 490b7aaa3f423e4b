//! Looks for the nearest and the farthest surfaces at full resolution, because coarse matching misses small ones.
//!
//! Windows of census codes are compared along their rows: at places without a coarse match, at some whose coarse match is among
//! the nearest, and at the upper and lower border, where a floor rises too steeply for windows of several rows. A disparity
//! counts if two windows of different shapes find it, each clearly better than all others, and back again from the right
//! image. Some are false even so, but hardly any lies outside the true range.

use std::ops::Range;

use fearless_simd::{Level, Simd, dispatch};
use rayon::prelude::*;

use super::{
    coarse::{Found, Matches},
    codes::{Codes, SPARE},
};
use crate::{Image, Size, StereoPair};

/// One place without a coarse match is chosen from each square of this many small pixels a side, if it has at least as many.
const CELL: usize = 6;

/// The most places whose coarse match is among the nearest.
const NEAREST: usize = 64;

/// Places that one thread examines together.
const TOGETHER: usize = 32;

/// At least so many disparities are compared, because the best of a few says little.
const FEWEST: usize = 8;

/// Disparities beside the best one that may be as good, because they belong to the same match.
const BESIDE: usize = 2;

/// By how many bits a window has to differ more at all other disparities.
const CLEARLY: u32 = 16;

/// A window: columns before and after its middle, and rows above and below it.
#[derive(Clone, Copy)]
struct Window {
    half_width: usize,
    half_height: usize,
}

/// The windows inside an image, and those for its first and its last row.
const INSIDE: [Window; 2] = [Window { half_width: 8, half_height: 1 }, Window { half_width: 4, half_height: 3 }];
const AT_THE_BORDER: [Window; 2] =
    [Window { half_width: 8, half_height: 0 }, Window { half_width: 12, half_height: 0 }];

/// A left pixel at full resolution, and the windows around it.
struct Place {
    x: usize,
    y: usize,
    windows: [Window; 2],
}

/// What coarse matching found.
pub(super) struct Coarse<'a> {
    /// The small left image.
    pub(super) small: &'a Image,
    pub(super) matches: &'a Matches,
    /// Those that count.
    pub(super) found: &'a [Found],
    /// The least and the largest disparity.
    pub(super) ends: [i32; 2],
    /// By how much images were shrunk.
    pub(super) factor: usize,
}

/// The disparities found at full resolution, in ascending order.
pub(super) fn disparities(pair: &StereoPair, coarse: &Coarse<'_>) -> Vec<i32> {
    let [least, largest] = coarse.ends.map(|end| end * coarse.factor as i32);
    let beyond = (largest - least) / 2 + coarse.factor as i32;
    let search = Search {
        pair,
        disparities: i64::from(least - beyond)..i64::from(largest + beyond) + 1,
        down: coarse.matches.rows_down * coarse.factor as isize,
    };
    let places = coarse.places(pair.size());
    let level = Level::new();
    let of_chunk = |places: &[Place]| dispatch!(level, simd => search.verified(simd, places));
    let mut disparities: Vec<i32> = places.par_chunks(TOGETHER).flat_map_iter(of_chunk).collect();
    disparities.sort_unstable();
    disparities
}

impl Coarse<'_> {
    /// The places to examine in images of this size.
    fn places(&self, size: Size) -> Vec<Place> {
        let Self { small, matches, found, ends: [_, largest], factor } = *self;
        let centre = |i: usize| i * factor + factor / 2;
        let inside = |(x, y): (usize, usize)| Place { x: centre(x), y: centre(y), windows: INSIDE };
        let nearest: Vec<_> = found.iter().filter(|&&(.., disparity)| disparity >= largest).collect();
        let some = nearest.iter().step_by(nearest.len().div_ceil(NEAREST).max(1));
        let mut places: Vec<Place> = holes(small, matches).chain(some.map(|&&(x, y, _)| (x, y))).map(inside).collect();
        // All columns: coarse matches of a steep floor are often false.
        for y in [1, size.height.saturating_sub(2)] {
            places.extend((0..small.size().width).map(|x| Place { x: centre(x), y, windows: AT_THE_BORDER }));
        }
        places
    }
}

/// In each cell of the small image with enough pixels without a match, the one with the most contrast between the columns beside
/// it.
fn holes(small: &Image, matches: &Matches) -> impl Iterator<Item = (usize, usize)> {
    let size = small.size();
    let firsts = |length: usize| (0..length).step_by(CELL);
    let cells = firsts(size.height).flat_map(move |y| firsts(size.width).map(move |x| (x, y)));
    cells.filter_map(move |(x, y)| {
        let rows = y..size.height.min(y + CELL);
        let pixels = rows.flat_map(|y| (x..size.width.min(x + CELL)).map(move |x| (x, y)));
        let holes: Vec<_> = pixels.filter(|&(x, y)| matches.at(x, y).is_none()).collect();
        // The first of several.
        let best = holes.iter().rev().max_by_key(|&&(x, y)| contrast(small, x, y));
        best.copied().filter(|_| holes.len() >= CELL)
    })
}

fn contrast(small: &Image, x: usize, y: usize) -> u8 {
    let row = small.greys_near(y as isize);
    match (x.checked_sub(1).and_then(|before| row.get(before)), row.get(x + 1)) {
        (Some(before), Some(after)) => before.abs_diff(*after),
        _ => 0,
    }
}

/// Where to search.
struct Search<'a> {
    pair: &'a StereoPair,
    disparities: Range<i64>,
    /// By how many rows right pixels lie below left ones.
    down: isize,
}

/// A pixel in one of the images.
#[derive(Clone, Copy)]
struct Pixel {
    x: usize,
    y: usize,
}

impl Search<'_> {
    /// The disparities of places that pass all tests.
    #[inline(always)]
    fn verified<S: Simd>(&self, simd: S, places: &[Place]) -> Vec<i32> {
        simd.vectorize(
            #[inline(always)]
            || {
                let mut compared = Compared::default();
                let mut disparities = Vec::new();
                // A loop is inlined where an iterator's closure may not be, and then would not take vectors.
                for place in places {
                    disparities.extend(self.verify(&mut compared, place));
                }
                disparities
            },
        )
    }

    #[inline(always)]
    fn verify(&self, compared: &mut Compared, &Place { x, y, windows: [first, second] }: &Place) -> Option<i32> {
        let disparity = self.match_window(compared, Pixel { x, y }, first)?;
        let other = self.match_window(compared, Pixel { x, y }, second)?;
        (disparity.abs_diff(other) <= 1).then_some(disparity)
    }

    /// The disparity of a window, if it is distinct and the way back leads to the same pixel.
    #[inline(always)]
    fn match_window(&self, compared: &mut Compared, left: Pixel, window: Window) -> Option<i32> {
        let images = [self.pair.left(), self.pair.right()];
        let x = left.x as i64;
        let right = left.y.checked_add_signed(self.down)?;
        let there =
            compared.best(images, left, right, x - self.disparities.end + 1..x - self.disparities.start + 1, window)?;
        if !there.is_distinct() {
            return None;
        }
        let (start, end) = (there.column as i64 + self.disparities.start, there.column as i64 + self.disparities.end);
        let [left_image, right_image] = images;
        let from = Pixel { x: there.column, y: right };
        let back = compared.best([right_image, left_image], from, left.y, start..end, window)?;
        (back.column.abs_diff(left.x) <= 1).then_some(left.x as i32 - there.column as i32)
    }
}

/// The best of several windows.
struct Best {
    /// The column of its middle.
    column: usize,
    /// Differing bits, at most 255.
    cost: u8,
    /// The least cost at columns more than [`BESIDE`] away.
    second: u8,
}

impl Best {
    fn is_distinct(&self) -> bool {
        u32::from(self.second) >= u32::from(self.cost) + CLEARLY
    }
}

/// What is compared for one place.
#[derive(Default)]
struct Compared {
    window: Codes,
    strip: Codes,
    costs: Vec<[u8; SPARE]>,
}

impl Compared {
    /// Compares the window around a pixel with those in row `y` of the other image, with their middles in `columns`. `None` if the
    /// window leaves its image, or if there are fewer than [`FEWEST`] to compare it with.
    #[inline(always)]
    fn best(
        &mut self,
        [own, other]: [&Image; 2],
        at: Pixel,
        y: usize,
        columns: Range<i64>,
        Window { half_width, half_height }: Window,
    ) -> Option<Best> {
        let rows = |y: usize| Some(y.checked_sub(half_height)?..y + half_height + 1);
        let width = other.size().width;
        let last = width.checked_sub(half_width)?;
        let first = columns.start.max(half_width as i64 + 1) as usize;
        let end = usize::try_from(columns.end).ok()?.min(last);
        if end < first + FEWEST {
            return None;
        }
        self.window.read(own, at.x.checked_sub(half_width)?..at.x + half_width, rows(at.y)?)?;
        self.strip.read(other, first - half_width..end - 1 + half_width, rows(y)?)?;
        self.compare(end - first, 2 * half_width, 2 * half_height + 1);
        let cost = self.least();
        let best = self.costs.as_flattened().iter().position(|&other| other == cost)?;
        let costs = self.costs.as_flattened_mut();
        let beside = best.saturating_sub(BESIDE)..costs.len().min(best + BESIDE + 1);
        costs[beside].fill(u8::MAX);
        Some(Best { column: first + best, cost, second: self.least() })
    }

    #[inline(always)]
    fn least(&self) -> u8 {
        let mut least = [u8::MAX; SPARE];
        for costs in &self.costs {
            least.iter_mut().zip(costs).for_each(|(least, &cost)| *least = cost.min(*least));
        }
        least.into_iter().fold(u8::MAX, u8::min)
    }

    /// Computes so many costs, in whole vectors, for windows of this width and height.
    #[inline(always)]
    fn compare(&mut self, count: usize, width: usize, height: usize) {
        self.costs.clear();
        for first in (0..count).step_by(SPARE) {
            let mut sums = [0_u8; SPARE];
            for row in 0..height {
                let own = &self.window.row(row, 0)[..width];
                let others = self.strip.row(row, first).windows(SPARE);
                for (&own, others) in own.iter().zip(others) {
                    for (sum, &other) in sums.iter_mut().zip(others) {
                        *sum = sum.saturating_add((own ^ other).count_ones() as u8);
                    }
                }
            }
            self.costs.push(sums);
        }
        self.costs.as_flattened_mut()[count..].fill(u8::MAX);
    }
}
