//! Checks whether rows correspond.

use super::points::Point;
use crate::Size;

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

impl RowOffsets {
    /// Whether only parts are off, and by no more than a row: rectified images can be like this.
    #[must_use]
    pub fn is_slight(&self) -> bool {
        self.whole == 0 && [self.left, self.right, self.top, self.bottom].iter().all(|rows| rows.abs() <= 1)
    }
}

/// The row offsets, if one other than 0 is clearly better in any part. The points were compared within `reach` rows.
pub(super) fn offsets(Size { width, height }: Size, points: &[Point], reach: usize) -> Option<RowOffsets> {
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
