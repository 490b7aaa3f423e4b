//! A quick survey of a pair before it is matched. It estimates the range of disparities, and detects images that are
//! exchanged, not rectified, or not a pair at all.
//!
//! Both images are shrunk to at most [`LONGEST_SIDE`] pixels a side. `coarse` then matches them window by window, in
//! both directions, over all disparities from minus to plus half the width. It keeps matches that agree in both
//! directions, are clearly better than all alternatives, and do not form specks. From them, `range` derives the range
//! of disparities and its sign; `ends` looks for the nearest and the farthest surfaces at full resolution. `points` matches a few
//! hundred places again there, and `rows` checks with them that rows correspond.
//!
//! The survey is plain integer arithmetic, so it gives the same result on every machine, backend and number of threads.

mod coarse;
mod codes;
mod ends;
pub(crate) mod points;
mod range;
mod rows;
mod shrink;

use coarse::Matches;
use points::Point;

use crate::{Error, StereoPair};

pub use range::{DisparityRange, SeenDisparities};
pub use rows::RowOffsets;
pub use shrink::LONGEST_SIDE;

/// The least share of pixels with a match in a pair. Real pairs have more than 0.6, photographs of different scenes
/// less than 0.01.
const LEAST_SHARE: f64 = 0.1;

/// If a smaller share of pixels has a match, rows may not correspond. Pairs whose rows correspond seldom fall below it.
const USUAL_SHARE: f64 = 0.5;

/// The most rows by which the shrunk right image is then shifted up and down.
const MOST_ROWS: isize = 3;

/// The fewest matches that allow a conclusion.
const LEAST_MATCHES: usize = 64;

/// If this share of matches has negative disparities, the images are exchanged.
const NEARLY_ALL: f64 = 0.9;

/// The result of surveying a pair.
#[derive(Clone, Debug, PartialEq)]
pub struct Survey {
    /// The share of pixels of the shrunk left image that have a reliable match, from 0 to 1.
    pub matched: f64,
    /// The disparities of the pair; `None` if too few pixels have a match.
    pub seen: Option<SeenDisparities>,
    /// Whether nearly all matches have a negative disparity, as if the images were exchanged.
    pub exchanged: bool,
    /// The offsets between corresponding rows, if an offset other than 0 is clearly better in any part of the image.
    pub rows: Option<RowOffsets>,
    /// The shades, of 256, from the darkest to the brightest of the shrunk left image, without 0.5 % of its pixels on either side.
    pub shades: u16,
    /// Whether both images are the same.
    pub identical: bool,
    /// Whether hardly any pixel has a match, although the images are large enough: they do not show the same scene.
    pub unlike: bool,
    /// Points that were matched at full resolution.
    pub(crate) points: Vec<Point>,
}

impl Survey {
    /// Surveys a pair.
    ///
    /// # Errors
    /// Only [`Error::OutOfMemory`]: every pair can be surveyed.
    pub fn of(pair: &StereoPair) -> Result<Self, Error> {
        Self::looking(pair, true)
    }

    /// Surveys a pair whose labels are known already: looks for the ends of its range in the shrunk images only.
    ///
    /// # Errors
    /// As [`Self::of`].
    pub fn coarse(pair: &StereoPair) -> Result<Self, Error> {
        Self::looking(pair, false)
    }

    fn looking(pair: &StereoPair, closely: bool) -> Result<Self, Error> {
        let factor = shrink::factor(pair.size());
        let small = shrink::shrunk(pair, factor)?;
        let looks = looks(&small)?;
        let best = looks.iter().reduce(|a, b| if b.count > a.count { b } else { a });
        let (count, matched) = best.map_or((0, 0.0), |best| (best.count, best.share()));
        let best = best.filter(|_| count >= LEAST_MATCHES && matched >= LEAST_SHARE);
        let negative = best.map_or(0, Matches::negative);
        // A shrunk image is still matched if its rows are apart by one pixel, and half a pixel more at its borders.
        let most_down = looks.iter().map(|look| look.rows_down.unsigned_abs()).max().unwrap_or(0);
        let reach = factor * (most_down + 1) + factor.div_ceil(2);
        let (points, seen) = rayon::join(
            || best.map_or_else(Vec::new, |_| points::find(pair, small.left(), &looks, factor, reach)),
            || best.and_then(|best| SeenDisparities::of(best, factor, closely.then_some((pair, small.left())))),
        );
        Ok(Self {
            identical: pair.left() == pair.right(),
            shades: shades(small.left().greys()),
            matched,
            seen,
            exchanged: best.is_some() && negative as f64 >= NEARLY_ALL * count as f64,
            rows: rows::offsets(pair.size(), &points, reach),
            points,
            unlike: best.is_none() && small.size().pixels() as f64 * LEAST_SHARE >= LEAST_MATCHES as f64,
        })
    }
}

/// The values from the least to the largest, without 0.5 % of all on either side.
fn shades(greys: &[u8]) -> u16 {
    let mut counts = [0_usize; 256];
    greys.iter().for_each(|&grey| counts[usize::from(grey)] += 1);
    let least = greys.len() / 200;
    let first = |counts: &mut dyn Iterator<Item = &usize>| {
        let sums = counts.scan(0, |sum, &count| {
            *sum += count;
            Some(*sum)
        });
        sums.take_while(|&sum| sum <= least).count() as u16
    };
    let (below, above) = (first(&mut counts.iter()), first(&mut counts.iter().rev()));
    256_u16.saturating_sub(below + above)
}

/// Matches the small pair row by row. If it finds few matches, it also tries the right image shifted up and down.
fn looks(small: &StereoPair) -> Result<Vec<Matches>, Error> {
    let first = coarse::find(small, 0)?;
    if first.share() >= USUAL_SHARE {
        return Ok(vec![first]);
    }
    let others = (1..=MOST_ROWS).flat_map(|rows| [-rows, rows]).map(|rows| coarse::find(small, rows));
    std::iter::once(Ok(first)).chain(others).collect()
}
