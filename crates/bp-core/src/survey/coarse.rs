//! Window matching of the shrunk pair, in both directions at once: compares each window of census codes with all
//! windows in the corresponding row of the other image.

mod search;

use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use self::search::Search;
use super::shrink::LONGEST_SIDE;
use crate::{DisparityMap, Error, StereoPair, census, finish, memory::Buffer};

/// The most rows that one thread matches together.
const ROWS: usize = 40;

/// Connected matches that cover less than `1 / SPECK` of the pixels are a speck.
const SPECK: usize = 400;

/// Fewer connected matches than this are always a speck.
const LEAST_PATCH: usize = 16;

/// Column, row and disparity of a match.
pub(super) type Found = (usize, usize, i32);

/// Reliable matches of the small left image.
pub(super) struct Matches {
    /// The matches of row y of the left image were searched for in row `y + rows_down` of the right image.
    pub(super) rows_down: isize,
    /// Disparities in small pixels.
    map: DisparityMap,
    /// How many pixels have a match.
    pub(super) count: usize,
}

impl Matches {
    /// How many pixels have a negative disparity.
    pub(super) fn negative(&self) -> usize {
        self.map.values().iter().filter(|&&disparity| disparity < 0.0).count()
    }

    /// The share of pixels that have a match, from 0 to 1.
    pub(super) fn share(&self) -> f64 {
        self.count as f64 / self.map.size().pixels() as f64
    }

    /// The width of the small images.
    pub(super) fn width(&self) -> usize {
        self.map.size().width
    }

    /// The disparity of a pixel, if it has a match.
    pub(super) fn at(&self, x: usize, y: usize) -> Option<i32> {
        let disparity = self.row(y)[x];
        disparity.is_finite().then_some(disparity as i32)
    }

    /// Every pixel that has a match.
    pub(super) fn found(&self) -> impl Iterator<Item = Found> {
        self.map.values().chunks_exact(self.width()).enumerate().flat_map(|(y, row)| {
            let known = row.iter().enumerate().filter(|(_, disparity)| disparity.is_finite());
            known.map(move |(x, &disparity)| (x, y, disparity as i32))
        })
    }

    /// The disparities of a row, not finite where there is no match.
    pub(super) fn row(&self, y: usize) -> &[f32] {
        &self.map.values()[y * self.width()..][..self.width()]
    }
}

/// Matches a small pair.
pub(super) fn find(small: &StereoPair, rows_down: isize) -> Result<Matches, Error> {
    let (size, level) = (small.size(), Level::new());
    debug_assert!(size.width <= LONGEST_SIDE);
    let codes = |image| census::codes(image, 0..size.width, 0..size.height);
    let codes: [Vec<u8>; 2] = rayon::join(|| codes(small.left()), || codes(small.right())).into();
    let mut disparities = Buffer::filled("coarse matches", size.pixels(), DisparityMap::UNKNOWN)?;
    // Parts of equal height keep all threads busy to the end.
    let rows = size.height.div_ceil(size.height.div_ceil(ROWS));
    disparities.par_chunks_mut(rows * size.width).enumerate().try_for_each(|(part, disparities)| {
        let mut search = Search::new(size, &codes, rows_down)?;
        dispatch!(level, simd => search.match_rows(simd, rows * part, disparities));
        Ok(())
    })?;
    let map = DisparityMap::of(size, disparities);
    let map = finish::remove_speckles(map, (size.pixels() / SPECK).max(LEAST_PATCH))?;
    let count = map.values().iter().filter(|disparity| disparity.is_finite()).count();
    Ok(Matches { rows_down, map, count })
}
