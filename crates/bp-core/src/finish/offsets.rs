//! Offsets from disparities to those at which the images match best.

mod best;
mod compared;
mod windows;

use std::ops::{Range, RangeInclusive};

use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use self::windows::Windows;
use super::{
    claims::Claims,
    means,
    rows::rows_together,
    variances::{Turn, turns},
};
use crate::{Error, IsStopped, Size, StereoPair, stop::go_on};

/// Disparities are tried in steps of a quarter of a pixel.
const STEPS: usize = 4;

/// The number of disparities that are tried, and the one in the middle.
const TRIED: usize = 5;
const MIDDLE: usize = TRIED / 2;

/// Writes the disparities of a map, `[height][width]`, plus the offsets, of about half a pixel at most, at which the right image
/// fits the left one best. They stay within `limits`.
///
/// Every pixel is compared with the right image at its own disparity, to a quarter, plus -1/2, -1/4, 0, 1/4 and 1/2. Grey
/// values between pixels are cubic interpolations (Keys 1981). The best offset has the smallest variance of grey differences in
/// the 7x7 window. The variance stays the same if one image is brighter. Only the three middle offsets can be the best; a parabola
/// through the variances at the best one, the one before and the one after gives the fraction. A pixel keeps its disparity if
/// one of the five matches lies outside the right image.
///
/// If asked to, drops pixels whose match fits another pixel better, by these variances; see [`super::check_unique`].
///
/// # Errors
/// [`Error::OutOfMemory`], [`Error::Stopped`].
pub(super) fn write_offsets(
    pair: &StereoPair,
    map: &[f32],
    limits: &RangeInclusive<f32>,
    unique: bool,
    refined: &mut [f32],
    is_stopped: IsStopped<'_>,
) -> Result<(), Error> {
    let width = pair.size().width;
    let rows = rows_together(map.len() / width, rayon::current_num_threads());
    refined.par_chunks_mut(rows * width).enumerate().try_for_each(|(index, refined)| {
        let first = rows * index;
        let part = Part { pair, map, rows: first..first + refined.len() / width, limits, unique };
        part.refine(refined, is_stopped)
    })
}

/// The temporary bytes of [`super::subpixel()`] besides maps, for a map of this size on this many threads: rows of windows, or
/// rows that means are taken of. [`super::check_unique`] needs fewer.
#[must_use]
pub fn window_bytes(size: Size, threads: usize) -> u64 {
    let rows = rows_together(size.height, threads);
    let parts = size.height.div_ceil(rows).min(threads) as u64;
    parts * (Windows::bytes(size.width) + Claims::bytes(size.width)).max(means::bytes(size.width, rows))
}

/// Some rows of a map.
struct Part<'a> {
    pair: &'a StereoPair,
    map: &'a [f32],
    rows: Range<usize>,
    limits: &'a RangeInclusive<f32>,
    unique: bool,
}

impl Part<'_> {
    fn refine(&self, refined: &mut [f32], is_stopped: IsStopped<'_>) -> Result<(), Error> {
        let (size, level) = (self.pair.size(), Level::new());
        let Size { width, height } = size;
        let mut windows = Windows::new(size)?;
        let mut claims = self.unique.then(|| Claims::new(width)).transpose()?;
        let row_of = |y: usize| &self.map[y * width..][..width];
        for turn in turns(self.rows.clone(), height) {
            go_on(is_stopped)?;
            match turn {
                Turn::Enter(y) => dispatch!(level, simd => windows.enter(simd, self.pair, y, row_of(y))),
                Turn::Middle(y) => {
                    let refined = &mut refined[(y - self.rows.start) * width..][..width];
                    dispatch!(level, simd => {
                        let variances = windows.refine(simd, y, row_of(y), self.limits, refined);
                        if let Some(claims) = &mut claims {
                            claims.drop_hidden(simd, variances, refined);
                        }
                    });
                }
                Turn::Leave(y) => dispatch!(level, simd => windows.leave(simd, y)),
            }
        }
        Ok(())
    }
}
