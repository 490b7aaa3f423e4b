//! A quick coarse look at a pair before it is matched: which disparities there are, and whether the two images are a
//! rectified pair in the right order at all.
//!
//! Both images are shrunk to at most [`LONGEST_SIDE`] pixels a side and matched window by window over all disparities
//! from minus to plus half the width, from both sides (`coarse`). What both sides agree on, is clearly better than
//! every other match and is no speck says where the range ends (`range`) and of which sign it is; a few hundred of
//! these matches, looked at in full size, say whether rows correspond (`rows`).
//!
//! It is plain integer arithmetic on one thread, so that every machine gives the same answer whatever backend matches.

mod coarse;
mod codes;
mod range;
mod rows;
mod shrink;

use coarse::Matches;

use crate::{Error, StereoPair};

pub use range::{DisparityRange, SeenDisparities};
pub use rows::RowOffsets;
pub use shrink::LONGEST_SIDE;

/// Least share of pixels with a match in a pair. Real pairs keep more than six tenths, two photographs of different
/// things less than one in a hundred.
const LEAST_SHARE: f64 = 0.1;

/// Where a smaller share of pixels has a match, rows may not correspond: a pair whose rows do seldom falls below.
const USUAL_SHARE: f64 = 0.5;

/// Rows of the shrunk images that the right one is then moved by, up and down.
const MOST_ROWS: isize = 3;

/// Fewest matches that anything is concluded from.
const LEAST_MATCHES: usize = 64;

/// Nearly all, as a share: so many matches of negative disparity mean exchanged images.
const NEARLY_ALL: f64 = 0.9;

/// What a coarse look at a pair found.
#[derive(Clone, Debug, PartialEq)]
pub struct Survey {
    /// Share of pixels of the shrunk left image that have a trustworthy match, 0 to 1.
    pub matched: f64,
    /// The disparities of the pair; `None` where too few pixels have a match.
    pub seen: Option<SeenDisparities>,
    /// Whether nearly all matches have a negative disparity, as if the images were exchanged.
    pub exchanged: bool,
    /// By how many rows corresponding rows are apart, where another offset than 0 is clearly better somewhere.
    pub rows: Option<RowOffsets>,
    /// Whether both images are the same.
    pub identical: bool,
    /// Whether there was enough to look at, and yet hardly any match: these are no two views of one scene.
    pub unlike: bool,
}

impl Survey {
    /// Looks at a pair.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`], and nothing else: every pair can be looked at.
    pub fn of(pair: &StereoPair) -> Result<Self, Error> {
        let factor = shrink::factor(pair.size());
        let small = shrink::shrunk(pair, factor)?;
        let looks = looks(&small)?;
        let best = looks.iter().reduce(|a, b| if b.count() > a.count() { b } else { a });
        let (count, matched) = best.map_or((0, 0.0), |best| (best.count(), best.share()));
        let best = best.filter(|_| count >= LEAST_MATCHES && matched >= LEAST_SHARE);
        let negative = best.map_or(0, |best| best.found().filter(|&(_, _, disparity)| disparity < 0).count());
        Ok(Self {
            identical: pair.left() == pair.right(),
            matched,
            seen: best.and_then(|best| SeenDisparities::of(best, factor)),
            exchanged: best.is_some() && negative as f64 >= NEARLY_ALL * count as f64,
            rows: best.and_then(|_| rows::offsets(pair, &looks, factor)),
            unlike: best.is_none() && small.size().pixels() as f64 * LEAST_SHARE >= LEAST_MATCHES as f64,
        })
    }
}

/// Matches of the small pair row by row; where those are few, also with the right image higher and lower.
fn looks(small: &StereoPair) -> Result<Vec<Matches>, Error> {
    let first = coarse::find(small, 0)?;
    if first.share() >= USUAL_SHARE {
        return Ok(vec![first]);
    }
    let others = (1..=MOST_ROWS).flat_map(|rows| [-rows, rows]).map(|rows| coarse::find(small, rows));
    std::iter::once(Ok(first)).chain(others).collect()
}
