//! Derives the labels that a pair needs from its coarse matches.

use super::{
    coarse::{Found, Matches},
    points,
};
use crate::{MAX_LABELS, Model, StereoPair};

/// One in this many matches may lie beyond either end of the range, because some false matches remain.
const BEYOND: usize = 1000;

/// Matches at either end of the range that are matched again at full resolution.
const AT_THE_END: usize = 64;

/// One in this many of those may lie beyond the end.
const STRAYS: usize = 4;

/// The margin added at both ends, in pixels, besides half a shrunk pixel.
const MARGIN: i32 = 2;

/// Another part of the range is added at its near end: near surfaces are often narrow and easily missed.
const NEARER: i32 = 6;

/// The number of labels is a multiple of this.
const LABEL_STEP: usize = 4;

/// The range of disparities that coarse matching found, in pixels of the pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SeenDisparities {
    /// The least disparity, ignoring one match in a thousand.
    pub least: i32,
    /// The largest disparity, ignoring one match in a thousand.
    pub largest: i32,
    /// How far off either may be.
    pub margin: i32,
}

/// The labels to match with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DisparityRange {
    /// Disparity of the first label in pixels.
    pub min_disparity: i32,
    /// Number of labels, at most [`MAX_LABELS`].
    pub labels: usize,
}

impl DisparityRange {
    /// Disparity of the last label in pixels.
    #[must_use]
    pub fn max_disparity(&self) -> i32 {
        self.min_disparity + self.labels as i32 - 1
    }

    /// The range from another first disparity to the same last one, with the number of labels rounded up.
    #[must_use]
    pub fn starting_at(&self, min_disparity: i32) -> Self {
        Self::spanning(min_disparity, self.max_disparity())
    }

    fn spanning(min_disparity: i32, max_disparity: i32) -> Self {
        let needed = (i64::from(max_disparity) - i64::from(min_disparity) + 1).clamp(1, MAX_LABELS as i64) as usize;
        Self { min_disparity, labels: needed.next_multiple_of(LABEL_STEP).min(MAX_LABELS) }
    }
}

impl SeenDisparities {
    pub(super) fn of(pair: &StereoPair, matches: &Matches, factor: usize) -> Option<Self> {
        let all: Vec<Found> = matches.found().collect();
        let [least, largest] = ends(all.iter().map(|&(.., disparity)| disparity).collect(), BEYOND)?;
        // If the match of a pixel may lie outside the right image, the one inside may be false.
        let is_inside = |x: usize| x as i32 >= largest && (x as i32 - least) < matches.width() as i32;
        let inside: Vec<Found> = all.iter().copied().filter(|&(x, ..)| is_inside(x)).collect();
        let inside = if inside.is_empty() { all } else { inside };
        let [least, largest] = ends(inside.iter().map(|&(.., disparity)| disparity).collect(), BEYOND)?;
        let exactly = |is_near: &dyn Fn(i32) -> bool| {
            let near: Vec<Found> = inside.iter().copied().filter(|&(.., disparity)| is_near(disparity)).collect();
            let some: Vec<Found> = near.iter().copied().step_by(near.len().div_ceil(AT_THE_END).max(1)).collect();
            ends(points::disparities(pair, &some, matches.rows_down, factor), STRAYS)
        };
        let step = factor as i32;
        Some(Self {
            least: exactly(&|disparity| disparity <= least).map_or(step * least, |[least, _]| least),
            largest: exactly(&|disparity| disparity >= largest).map_or(step * largest, |[_, largest]| largest),
            margin: step / 2 + MARGIN,
        })
    }

    /// Labels that cover this range and a margin. Negative disparities are covered only if some were seen. Rounding up adds
    /// labels at the near end (large disparities). Labels beyond [`MAX_LABELS`] are dropped at the same end.
    #[must_use]
    pub fn range(&self) -> DisparityRange {
        let first = self.least - self.margin;
        let nearer = (self.largest - self.least) / NEARER;
        DisparityRange::spanning(if self.least < 0 { first } else { first.max(0) }, self.largest + self.margin + nearer)
    }

    /// Whether some disparities lie below the first label of a model, and whether some lie above its last.
    #[must_use]
    pub fn beyond(&self, model: &Model) -> [bool; 2] {
        let (first, last) = (model.disparity(0), model.disparity(model.labels() as u16 - 1));
        [self.least + self.margin < first, self.largest - self.margin > last]
    }
}

/// The least and the largest value, when one in `strays` at either end does not count.
fn ends(mut values: Vec<i32>, strays: usize) -> Option<[i32; 2]> {
    let strays = values.len() / strays;
    let last = values.len().checked_sub(strays + 1)?;
    let least = *values.select_nth_unstable(strays).1;
    Some([least, *values.select_nth_unstable(last).1])
}
