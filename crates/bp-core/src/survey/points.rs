//! Matches a few hundred points again at full resolution, also above and below their rows.

use std::cmp::Reverse;

use fearless_simd::{Level, Simd, dispatch};
use rayon::prelude::*;

use super::{
    coarse::{Found, Matches},
    codes::Codes,
};
use crate::{Image, Size, StereoPair};

/// One point is chosen from each square of this many small pixels a side.
const CELL: usize = 6;

/// Points that one thread matches together.
const TOGETHER: usize = 64;

/// Columns of a window: their codes fill 64 bits.
const WINDOW_WIDTH: usize = 8;

/// Rows of a window.
const WINDOW_HEIGHT: usize = 7;

/// A left pixel, and its best match in the right image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Point {
    /// Column and row in the left image.
    pub(crate) x: usize,
    pub(crate) y: usize,
    /// Column and row in the right image.
    pub(crate) column: usize,
    pub(crate) row: usize,
    /// How much the window differs from the best one in each row, from `y - reach` to `y + reach`.
    pub(super) costs: Vec<u32>,
}

/// A left pixel at full resolution, and the column where its match is expected.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Place {
    x: usize,
    y: usize,
    column: i64,
}

impl Place {
    fn of((x, y, disparity): Found, factor: usize) -> Self {
        let centre = |i: usize| i * factor + factor / 2;
        let column = centre(x) as i64 - factor as i64 * i64::from(disparity);
        Self { x: centre(x), y: centre(y), column }
    }
}

/// The points that have the most texture. `looks` are coarse matches at several row offsets, and `reach` is the number of rows to
/// search in both directions. Points whose windows leave an image are left out.
pub(super) fn find(pair: &StereoPair, small: &Image, looks: &[Matches], factor: usize, reach: usize) -> Vec<Point> {
    let places: Vec<Place> = looks.iter().flat_map(|look| places(small, look, factor)).collect();
    let level = Level::new();
    let of_chunk = |places: &[Place]| dispatch!(level, simd => points(simd, pair, places, factor, reach));
    places.par_chunks(TOGETHER).flat_map_iter(of_chunk).collect()
}

/// In each cell of the small image, the match with the most contrast between the rows above and below.
fn places(small: &Image, look: &Matches, factor: usize) -> Vec<Place> {
    let of_cells = |cells: usize| {
        let found = places_below(small, look, CELL * cells);
        found.into_iter().map(|found| Place::of(found, factor))
    };
    (0..small.size().height.div_ceil(CELL)).into_par_iter().flat_map_iter(of_cells).collect()
}

/// Those of the cells whose first row is `top`. Of several with the same contrast, the first one.
fn places_below(small: &Image, look: &Matches, top: usize) -> Vec<Found> {
    let Size { width, height } = small.size();
    // For each column, one more than the most contrast of its matches, times `CELL`, plus how far up that match is.
    let mut ranks = vec![0_u16; width];
    for (y, up) in (top..height).zip((0..CELL as u16).rev()) {
        for ((best, contrast), disparity) in ranks.iter_mut().zip(contrasts(small, y)).zip(look.row(y)) {
            let rank = (contrast + 1) * CELL as u16 + up;
            *best = (*best).max(if disparity.is_finite() { rank } else { 0 });
        }
    }
    let of_cell = |(left, ranks): (usize, &[u16])| {
        let best = ranks.iter().enumerate().min_by_key(|&(_, &rank)| Reverse(rank));
        let (column, &rank) = best.filter(|&(_, &rank)| rank > 0)?;
        let (x, y) = (left + column, top + CELL - 1 - usize::from(rank) % CELL);
        look.at(x, y).map(|disparity| (x, y, disparity))
    };
    (0..).step_by(CELL).zip(ranks.chunks(CELL)).filter_map(of_cell).collect()
}

/// The sums of differences between the three pixels above and the three below the pixels of a row.
fn contrasts(small: &Image, y: usize) -> Vec<u16> {
    let [above, below] = [-1, 1].map(|dy| small.greys_near(y as isize + dy));
    let mut differences = vec![0; above.len() + 2];
    for ((difference, &above), &below) in differences[1..].iter_mut().zip(above).zip(below) {
        *difference = u16::from(above.abs_diff(below));
    }
    differences.windows(3).map(|three| three.iter().sum()).collect()
}

/// Matches some places.
#[inline(always)]
fn points<S: Simd>(simd: S, pair: &StereoPair, places: &[Place], factor: usize, reach: usize) -> Vec<Point> {
    simd.vectorize(
        #[inline(always)]
        || {
            let mut points = Vec::with_capacity(places.len());
            let mut compared = Compared::default();
            for &place in places {
                points.extend(compared.point(pair, place, factor, reach));
            }
            points
        },
    )
}

/// What is compared for one place.
#[derive(Default)]
struct Compared {
    window: Codes,
    /// The part of the right image with all windows that are compared.
    strips: Codes,
    /// Eight columns of all rows of it.
    words: Vec<u64>,
    /// How much the window there differs, by the row that it begins in.
    differing: Vec<u64>,
}

impl Compared {
    /// Compares the window of a place with those within `factor` columns and `reach` rows; `None` if one leaves its image.
    #[inline(always)]
    fn point(
        &mut self,
        pair: &StereoPair,
        Place { x, y, column }: Place,
        factor: usize,
        reach: usize,
    ) -> Option<Point> {
        let Self { window, strips, words, differing } = self;
        let (half_width, half_height) = (WINDOW_WIDTH / 2, WINDOW_HEIGHT / 2);
        let (left, top) = (x.checked_sub(half_width)?, y.checked_sub(half_height + reach)?);
        let first = usize::try_from(column - (half_width + factor) as i64).ok()?;
        let middle = top + reach..top + reach + WINDOW_HEIGHT;
        window.read(pair.left(), left..left + WINDOW_WIDTH, middle)?;
        let rows = 2 * reach + WINDOW_HEIGHT;
        strips.read(pair.right(), first..first + 2 * factor + WINDOW_WIDTH, top..top + rows)?;
        let mut costs = vec![u32::MAX; 2 * reach + 1];
        let mut best = (u32::MAX, 0, 0, 0);
        for across in 0..=2 * factor {
            words.clear();
            words.extend((0..rows).map(|row| word(strips.row(row, across))));
            differing.clear();
            differing.resize(costs.len(), 0);
            // Rows of windows at once, which takes vectors.
            for row in 0..WINDOW_HEIGHT {
                let own = word(window.row(row, 0));
                let others = words[row..].iter().map(|word| u64::from((word ^ own).count_ones()));
                differing.iter_mut().zip(others).for_each(|(differing, other)| *differing += other);
            }
            for (down, (cost, &differing)) in costs.iter_mut().zip(&*differing).enumerate() {
                let differing = differing as u32;
                *cost = differing.min(*cost);
                best = best.min((differing, reach.abs_diff(down), down, across));
            }
        }
        let (_, _, down, across) = best;
        Some(Point { x, y, column: first + half_width + across, row: y + down - reach, costs })
    }
}

/// The codes of [`WINDOW_WIDTH`] pixels.
#[inline(always)]
fn word(codes: &[u8]) -> u64 {
    codes.first_chunk().copied().map_or(0, u64::from_le_bytes)
}

#[cfg(test)]
mod tests {
    use super::{super::coarse, *};

    #[test]
    #[cfg_attr(miri, ignore = "takes minutes")]
    fn each_cell_gives_its_match_with_the_most_contrast() {
        let view = |shift: usize| {
            // Dark and bright areas, so that contrasts are alike in many cells.
            let grey = |x: usize, y: usize| if x * x * y % 7 < 3 { 20 } else { (x * x * 29 + y * y * 13) as u8 };
            let size = Size { width: 83, height: 44 };
            let greys: Vec<u8> = size.nodes().map(|node| grey(node.x + shift, node.y)).collect();
            Image::from_grey(size.width, size.height, greys).unwrap()
        };
        let (left, factor) = (view(0), 3);
        let look = coarse::find(&StereoPair::new(left.clone(), view(4)).unwrap(), 0).unwrap();
        let contrast = |&(x, y, _): &Found| -> i32 {
            let [above, below] = [-1, 1].map(|dy| left.greys_near(y as isize + dy));
            let columns = x.saturating_sub(1)..(x + 2).min(above.len());
            columns.map(|x| i32::from(above[x].abs_diff(below[x]))).sum()
        };
        let mut cells = std::collections::BTreeMap::<_, Vec<Found>>::new();
        look.found().for_each(|found| cells.entry((found.1 / CELL, found.0 / CELL)).or_default().push(found));
        let best = cells.values().filter_map(|of_cell| of_cell.iter().min_by_key(|found| -contrast(found)));
        let expected: Vec<_> = best.map(|&found| Place::of(found, factor)).collect();
        assert_eq!(places(&left, &look, factor), expected);
        assert!(expected.len() > 40, "{}", expected.len());
    }
}
