//! Offsets from disparities to those at which the images match best.

mod best;
mod compared;
mod windows;

use std::ops::Range;

use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use self::windows::Windows;
use super::{IsStopped, go_on};
use crate::{DisparityMap, Error, StereoPair, memory, metrics::check_size};

/// Disparities are tried in steps of a quarter of a pixel.
const STEPS: usize = 4;

/// The number of disparities that are tried, and the one in the middle.
const TRIED: usize = 5;
const MIDDLE: usize = TRIED / 2;

/// How far windows reach from their centres.
const REACH: usize = 3;
const SIDE: usize = 2 * REACH + 1;

/// Rows that one thread computes together.
const ROWS: usize = 48;

/// Adds to every known disparity the offset, of about half a pixel at most, at which the right image fits the left one best.
///
/// Every pixel is compared with the right image at its own disparity, to a quarter, plus -1/2, -1/4, 0, 1/4 and 1/2. Grey
/// values between pixels are cubic interpolations (Keys 1981). The best offset has the smallest variance of grey differences in
/// the 7x7 window. The variance stays the same if one image is brighter. Only the three middle offsets can be the best; a parabola
/// through the variances at the best one, the one before and the one after gives the fraction. A pixel keeps its disparity if
/// one of the five matches lies outside the right image.
///
/// # Errors
/// [`Error::WrongSize`] if the map has another size than the pair, [`Error::OutOfMemory`], [`Error::Stopped`].
pub(super) fn add_offsets(
    pair: &StereoPair,
    map: &DisparityMap,
    is_stopped: IsStopped<'_>,
) -> Result<DisparityMap, Error> {
    check_size("the disparity map", map.size(), pair.size())?;
    let size = pair.size();
    let mut values = memory::filled("a map", size.pixels(), 0.0)?;
    let parts = values.par_chunks_mut(ROWS * size.width).enumerate();
    parts.try_for_each(|(index, values)| {
        let first = ROWS * index;
        let rows = first..first + values.len() / size.width;
        refine(pair, map, rows, values, is_stopped)
    })?;
    DisparityMap::new(size, values)
}

/// Writes the disparities of some rows.
fn refine(
    pair: &StereoPair,
    map: &DisparityMap,
    rows: Range<usize>,
    values: &mut [f32],
    is_stopped: IsStopped<'_>,
) -> Result<(), Error> {
    let (width, height, level) = (pair.size().width, pair.size().height, Level::new());
    let mut windows = Windows::new(width)?;
    let row_of = |y: usize| &map.values()[y * width..][..width];
    let top = rows.start.saturating_sub(REACH);
    for coming in top..rows.end + REACH {
        go_on(is_stopped)?;
        if coming < height {
            dispatch!(level, simd => windows.enter(simd, pair, coming, row_of(coming)));
        }
        let Some(y) = coming.checked_sub(REACH).filter(|y| rows.contains(y)) else { continue };
        let refined = &mut values[(y - rows.start) * width..][..width];
        dispatch!(level, simd => windows.refine(simd, row_of(y), refined));
        if let Some(last) = y.checked_sub(REACH) {
            dispatch!(level, simd => windows.leave(simd, last));
        }
    }
    Ok(())
}
