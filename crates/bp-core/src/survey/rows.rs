//! Checks whether rows correspond: compares windows of census codes around a few hundred matches at full resolution.

use std::ops::Range;

use super::coarse::Matches;
use crate::{Image, Node, Size, StereoPair, census};

/// The number of matches to check. Up to twice as many are checked.
const POINTS: usize = 256;

/// The factor on [`POINTS`] if there are coarse matches at several row offsets, because many of those are false.
const MORE: usize = 4;

/// Columns of a window: their codes fill 64 bits.
const WINDOW_WIDTH: usize = 8;

/// Rows of a window.
const WINDOW_HEIGHT: usize = 7;

/// A row offset is clearly better if the sum of the points' gains is at least this many times the root of the sum of
/// their squares. Chance hardly ever gives 4, and fewer than 16 points never do.
const CLEARLY: i64 = 4;

/// By how many rows the right image lies too low, in pixels of the pair: left pixel (x, y) corresponds to right pixel
/// (x - d, y + offset). If the offsets of the parts differ, one image is rotated or scaled relative to the other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RowOffsets {
    /// In all parts together.
    pub whole: i32,
    /// In the left third.
    pub left: i32,
    /// In the right third.
    pub right: i32,
    /// In the upper third.
    pub top: i32,
    /// In the lower third.
    pub bottom: i32,
}

/// A left pixel, and how much its window differs from the best match at each row offset from `-reach` to `reach`.
struct Point {
    x: usize,
    y: usize,
    costs: Vec<u32>,
}

/// The row offsets, if one other than 0 is clearly better in any part. `looks` are coarse matches at several offsets.
pub(super) fn offsets(pair: &StereoPair, looks: &[Matches], factor: usize) -> Option<RowOffsets> {
    let most_down = looks.iter().map(|look| look.rows_down.unsigned_abs()).max()?;
    let reach = factor * (most_down + 2);
    let look = |(x, y, column)| Some(Point { x, y, costs: costs(pair, Node { x, y }, column, reach, factor)? });
    let points: Vec<Point> = places(looks, factor).filter_map(look).collect();
    let Size { width, height } = pair.size();
    let offset = |part: &dyn Fn(&Point) -> bool| {
        let points: Vec<&Point> = points.iter().filter(|point| part(point)).collect();
        offset(&points, reach)
    };
    let offsets = RowOffsets {
        whole: offset(&|_| true),
        left: offset(&|point| 3 * point.x < width),
        right: offset(&|point| 3 * point.x >= 2 * width),
        top: offset(&|point| 3 * point.y < height),
        bottom: offset(&|point| 3 * point.y >= 2 * height),
    };
    (offsets != RowOffsets::default()).then_some(offsets)
}

/// The row offset at which windows differ least, if the points gain clearly more from it than by chance; otherwise 0.
fn offset(points: &[&Point], reach: usize) -> i32 {
    let offset = |i: usize| i as i32 - reach as i32;
    let cost = |i: usize| points.iter().map(|point| u64::from(point.costs[i])).sum::<u64>();
    let best = (0..=2 * reach).min_by_key(|&i| (cost(i), offset(i).abs())).unwrap_or(reach);
    let gains = points.iter().map(|point| i64::from(point.costs[reach]) - i64::from(point.costs[best]));
    let (gain, squares) = gains.fold((0, 0), |(sum, squares), gain| (sum + gain, squares + gain * gain));
    if gain > 0 && gain * gain >= CLEARLY * CLEARLY * squares { offset(best) } else { 0 }
}

/// Left pixels at full resolution, and the columns that they match in the right image.
fn places(looks: &[Matches], factor: usize) -> impl Iterator<Item = (usize, usize, i64)> {
    let count: usize = looks.iter().map(Matches::count).sum();
    let each = move |look: &Matches| {
        let centre = |i: usize| i * factor + factor / 2;
        let place = |(x, y, disparity): (usize, usize, i32)| {
            (centre(x), centre(y), centre(x) as i64 - factor as i64 * i64::from(disparity))
        };
        look.found().map(place).collect::<Vec<_>>()
    };
    let points = if looks.len() > 1 { MORE * POINTS } else { POINTS };
    looks.iter().flat_map(each).step_by((count / points).max(1))
}

/// The least number of bits that differ at each row offset from `-reach` to `reach`, over the columns within `factor`
/// of `column`; `None` if a window leaves its image.
fn costs(pair: &StereoPair, Node { x, y }: Node, column: i64, reach: usize, factor: usize) -> Option<Vec<u32>> {
    let size = pair.size();
    let (half_width, half_height) = (WINDOW_WIDTH / 2, WINDOW_HEIGHT / 2);
    let (left, top) = (x.checked_sub(half_width)?, y.checked_sub(half_height + reach)?);
    let (left_columns, rows) = (left..left + WINDOW_WIDTH, top..top + 2 * reach + WINDOW_HEIGHT);
    let left = usize::try_from(column - (half_width + factor) as i64).ok()?;
    let right_columns = left..left + 2 * factor + WINDOW_WIDTH;
    if left_columns.end.max(right_columns.end) > size.width || rows.end > size.height {
        return None;
    }
    let window = words(pair.left(), left_columns, y - half_height..y + half_height + 1);
    let strips = words(pair.right(), right_columns, rows);
    let differing = |strips: &[Vec<u64>], place: usize| -> u32 {
        strips.iter().zip(&window).map(|(strip, row)| (strip[place] ^ row[0]).count_ones()).sum()
    };
    let least = |strips: &[Vec<u64>]| (0..=2 * factor).map(|place| differing(strips, place)).min().unwrap_or(0);
    Some(strips.windows(WINDOW_HEIGHT).map(least).collect())
}

/// The codes of each row of a rectangle as words: one for each run of [`WINDOW_WIDTH`] consecutive codes.
fn words(image: &Image, columns: Range<usize>, rows: Range<usize>) -> Vec<Vec<u64>> {
    let width = columns.len();
    let word = |codes: &[u8]| codes.iter().fold(0, |word: u64, &code| word << 8 | u64::from(code));
    let codes = census::codes(image, columns, rows);
    codes.chunks_exact(width).map(|row| row.windows(WINDOW_WIDTH).map(word).collect()).collect()
}
