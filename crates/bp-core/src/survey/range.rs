//! Derives the labels that a pair needs from its coarse matches.

use super::coarse::Matches;
use crate::{MAX_LABELS, Model};

/// One in this many matches may lie beyond either end of the range, because some false matches remain.
const BEYOND: usize = 1000;

/// The margin added at both ends, in shrunk pixels. A coarse disparity may be off by one, and parts of surfaces beyond
/// the range found are narrow and easily missed.
const MARGIN: i32 = 2;

/// The number of labels is a multiple of this.
const LABEL_STEP: usize = 16;

/// The range of disparities that coarse matching found, in pixels of the pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SeenDisparities {
    /// The least disparity, ignoring one match in a thousand.
    pub least: i32,
    /// The largest disparity, ignoring one match in a thousand.
    pub largest: i32,
    /// How far off either may be: one pixel of the shrunk images.
    pub step: i32,
}

/// The labels to match with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DisparityRange {
    /// Disparity of the first label in pixels.
    pub min_disparity: i32,
    /// Number of labels, a multiple of 16 and at most [`MAX_LABELS`].
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
    pub(super) fn of(matches: &Matches, factor: usize) -> Option<Self> {
        let mut found: Vec<i32> = matches.found().map(|(_, _, disparity)| disparity).collect();
        found.sort_unstable();
        let beyond = found.len() / BEYOND;
        let (least, largest) = (*found.get(beyond)?, *found.get(found.len().checked_sub(beyond + 1)?)?);
        let step = factor as i32;
        Some(Self { least: step * least, largest: step * largest, step })
    }

    /// Labels that cover this range and a margin. Rounding up adds labels at the near end (large disparities). Labels
    /// beyond [`MAX_LABELS`] are dropped at the same end.
    #[must_use]
    pub fn range(&self) -> DisparityRange {
        DisparityRange::spanning(self.least - MARGIN * self.step, self.largest + MARGIN * self.step)
    }

    /// Whether some disparities lie below the first label of a model, and whether some lie above its last.
    #[must_use]
    pub fn beyond(&self, model: &Model) -> [bool; 2] {
        let (first, last) = (model.disparity(0), model.disparity(model.labels() as u16 - 1));
        [self.least + self.step < first, self.largest - self.step > last]
    }
}
