//! Derives the labels that a pair needs from its coarse matches.

use super::{
    coarse::{Found, Matches},
    ends::{self, Coarse},
    shrink::LONGEST_SIDE,
};
use crate::{Image, MAX_LABELS, Model, StereoPair};

/// One in this many matches may lie beyond either end of the range, because some false matches remain.
const BEYOND: usize = 1000;

/// If so many disparities that were found at full resolution lie at an end of the range, or beyond, it ends with them.
const ENOUGH: usize = 4;

/// So many are enough half a small pixel farther inside, because coarse matches may be a small pixel off.
const MANY: usize = 16;

/// The margin at either end is one part in this many of the range, and 1 px.
const MARGIN: i32 = 20;

/// A far disparity counts only if there is another one within one part in this many of the range. Far
/// surfaces are wide. Near ones are often narrow, so one place is enough for them.
const COMPANION: i32 = 16;

/// The range of disparities that a survey found, in pixels of the pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SeenDisparities {
    /// The least disparity.
    pub least: i32,
    /// The largest disparity.
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

    /// The range from another first disparity to the same last one.
    #[must_use]
    pub fn starting_at(&self, min_disparity: i32) -> Self {
        Self::spanning(min_disparity, self.max_disparity())
    }

    fn spanning(min_disparity: i32, max_disparity: i32) -> Self {
        let needed = (i64::from(max_disparity) - i64::from(min_disparity) + 1).clamp(1, MAX_LABELS as i64) as usize;
        Self { min_disparity, labels: needed }
    }
}

impl SeenDisparities {
    /// The range of coarse matches. With the pair and its shrunk left image, its ends are also looked for at full resolution.
    pub(super) fn of(matches: &Matches, factor: usize, closely: Option<(&StereoPair, &Image)>) -> Option<Self> {
        let all = outermost(matches.found())?;
        // If the match of a pixel may lie outside the right image, the one inside may be false.
        let is_inside = |&(x, ..): &Found| x as i32 >= all[1] && (x as i32 - all[0]) < matches.width() as i32;
        let inside = || matches.found().filter(is_inside);
        let ends = outermost(inside());
        let [least, largest] = ends.unwrap_or(all);
        let step = factor as i32;
        let Some((pair, small)) = closely else {
            let margin = margin(step * (largest - least)) + step / 2;
            let [least, largest] = outside([step * least, step * largest], step);
            return Some(Self { least, largest, margin });
        };
        let found: Vec<Found> = if ends.is_some() { inside().collect() } else { matches.found().collect() };
        let mut exact =
            ends::disparities(pair, &Coarse { small, matches, found: &found, ends: [least, largest], factor });
        // Repeated pictures match far away; a pair that shows no negative disparity has none.
        exact.retain(|&disparity| least < 0 || disparity >= 0);
        let [least, largest] = joined([step * least, step * largest], step, &exact);
        Some(Self { least, largest, margin: margin(largest - least) })
    }

    /// Labels that cover this range and a margin. Negative disparities are covered only if some were seen. Labels beyond
    /// [`MAX_LABELS`] are dropped at the near end (large disparities).
    #[must_use]
    pub fn range(&self) -> DisparityRange {
        let first = self.least - self.margin;
        DisparityRange::spanning(if self.least < 0 { first } else { first.max(0) }, self.largest + self.margin)
    }

    /// Whether some disparities lie below the first label of a model, and whether some lie above its last.
    #[must_use]
    pub fn beyond(&self, model: &Model) -> [bool; 2] {
        let (first, last) = (model.disparity(0), model.disparity(model.labels() as u16 - 1));
        [self.least + self.margin < first, self.largest - self.margin > last]
    }
}

/// The least and the largest disparity, when one in [`BEYOND`] at either end does not count.
fn outermost(found: impl Iterator<Item = Found>) -> Option<[i32; 2]> {
    // How often each disparity occurs, from minus to plus the width of a shrunk image.
    let mut counts = [0_usize; 2 * LONGEST_SIDE + 1];
    found.for_each(|(.., disparity)| counts[(disparity + LONGEST_SIDE as i32) as usize] += 1);
    let strays = counts.iter().sum::<usize>() / BEYOND;
    let reached = |mut sum: usize| {
        move |&count: &usize| {
            sum += count;
            sum > strays
        }
    };
    let (least, largest) = (counts.iter().position(reached(0))?, counts.iter().rposition(reached(0))?);
    Some([least, largest].map(|index| index as i32 - LONGEST_SIDE as i32))
}

/// The ends of the range in pixels: those of coarse matching, half a shrunk pixel farther out, and what was found at full
/// resolution, in ascending order. Where that is enough, it alone counts.
fn joined([least, largest]: [i32; 2], step: i32, exact: &[i32]) -> [i32; 2] {
    let distance = ((largest - least) / COMPANION).max(2);
    let far = exact.windows(2).find(|pair| pair[1] - pair[0] <= distance).map(|pair| pair[0]);
    let near = exact.last().copied();
    let enough = |is_near: &dyn Fn(i32, i32) -> bool| {
        let within = |reach: i32| exact.iter().filter(|&&disparity| is_near(disparity, reach)).count();
        within(step) >= ENOUGH || within(step + step / 2) >= MANY
    };
    let far_enough = enough(&|disparity, reach| disparity <= least + reach);
    let near_enough = enough(&|disparity, reach| disparity >= largest - reach);
    // Few pairs have negative disparities, so false matches are likelier.
    let far_enough = far_enough || least < 0;
    let outside = outside([least, largest], step);
    [
        far.map_or(outside[0], |far| if far_enough { far } else { far.min(outside[0]) }),
        near.map_or(outside[1], |near| if near_enough { near } else { near.max(outside[1]) }),
    ]
}

/// Ends that were found in shrunk images, half a shrunk pixel farther out. What is not negative remains so.
fn outside([least, largest]: [i32; 2], step: i32) -> [i32; 2] {
    let farthest = if least < 0 { i32::MIN } else { 0 };
    [(least - step / 2).max(farthest), largest + step / 2]
}

fn margin(range: i32) -> i32 {
    1 + range / MARGIN
}

#[cfg(test)]
mod tests {
    use super::joined;

    #[test]
    fn ends_are_those_found_at_full_resolution_if_these_are_enough() {
        let joined = |exact: &[i32]| joined([20, 60], 4, exact);
        assert_eq!(joined(&[]), [18, 62], "half a small pixel farther out");
        assert_eq!(joined(&[23, 23, 24, 24, 56, 56, 57, 57]), [23, 57]);
        assert_eq!(joined(&[23, 23, 24, 25, 55, 56, 57, 57]), [18, 62], "too few");
        assert_eq!(joined(&[[26; 15], [54; 15]].concat()), [18, 62], "not enough, farther inside");
        assert_eq!(joined(&[[26; 16], [54; 16]].concat()), [26, 54]);
        assert_eq!(joined(&[[27; 16], [53; 16]].concat()), [18, 62], "too far inside");
        assert_eq!(joined(&[12, 14, 40, 71]), [12, 71], "few count if they lie beyond");
        assert_eq!(joined(&[11, 14, 40, 44]), [18, 62], "a far one needs another one near by");
    }

    #[test]
    fn few_pairs_have_negative_disparities() {
        assert_eq!(joined([0, 40], 4, &[]), [0, 42]);
        assert_eq!(joined([-20, 40], 4, &[]), [-22, 42]);
        assert_eq!(joined([-20, 40], 4, &[8, 9, 20]), [8, 42]);
    }
}
