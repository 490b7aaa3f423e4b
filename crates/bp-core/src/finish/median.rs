//! The median filter.

use std::array;

use fearless_simd::{Level, Select, Simd, SimdBase, dispatch, f32x16};
use rayon::prelude::*;

use super::window::{Frame, Framed};
use crate::{DisparityMap, Error, IsStopped, stop::go_on};

/// The window sides that [`median`] supports.
pub const MEDIANS: [usize; 3] = [3, 5, 7];

/// How many columns are sorted together.
const LANES: usize = 16;

/// Replaces every known disparity by the median of the known ones in the `side` x `side` window around it. The border
/// repeats outward. The median of an even number of values is the smaller of the two in the middle.
///
/// # Errors
/// [`Error::Plan`] if `side` is not one of [`MEDIANS`], [`Error::OutOfMemory`], [`Error::Stopped`].
pub fn median(map: &DisparityMap, side: usize, is_stopped: IsStopped<'_>) -> Result<DisparityMap, Error> {
    match side {
        3 => medians::<3, 9>(map, is_stopped),
        5 => medians::<5, 25>(map, is_stopped),
        7 => medians::<7, 49>(map, is_stopped),
        _ => Err(Error::Plan("a median is over windows of 3, 5 or 7 pixels")),
    }
}

/// Medians of windows of `VALUES` values, which are `SIDE` x `SIDE`.
fn medians<const SIDE: usize, const VALUES: usize>(
    map: &DisparityMap,
    is_stopped: IsStopped<'_>,
) -> Result<DisparityMap, Error> {
    let (size, level) = (map.size(), Level::new());
    let framed = Framed::new(size, map.values(), SIDE / 2, Frame::Repeated)?;
    let mut medians = map.clone().into_values();
    medians.par_chunks_exact_mut(size.width).enumerate().try_for_each(|(y, row)| {
        go_on(is_stopped)?;
        let windows = array::from_fn(|index| framed.row(y, index % SIDE, index / SIDE));
        dispatch!(level, simd => write_row::<_, VALUES>(simd, &windows, row));
        Ok(())
    })?;
    Ok(DisparityMap::of(size, medians))
}

/// Writes the medians of a row. `windows` holds a shifted row for every position in the window.
#[inline(always)]
fn write_row<S: Simd, const VALUES: usize>(simd: S, windows: &[&[f32]; VALUES], row: &mut [f32]) {
    simd.vectorize(
        #[inline(always)]
        || {
            for (index, medians) in row.chunks_mut(LANES).enumerate() {
                write_chunk(simd, windows, index * LANES, medians);
            }
        },
    );
}

/// Writes the medians of the windows from column `start` on.
#[inline(always)]
fn write_chunk<S: Simd, const VALUES: usize>(simd: S, windows: &[&[f32]; VALUES], start: usize, medians: &mut [f32]) {
    let mut values = [f32x16::splat(simd, 0.0); VALUES];
    let mut largest = values[0];
    for (values, row) in values.iter_mut().zip(windows) {
        *values = f32x16::load_array(simd, chunk(&row[start..]));
        largest = largest.max(*values);
    }
    let largest: [f32; LANES] = largest.into();
    if largest.contains(&DisparityMap::UNKNOWN) {
        let near = |lane: usize| windows.iter().map(move |row| row[start + lane]);
        medians.iter_mut().enumerate().for_each(|(lane, median)| *median = of_known(near(lane), *median));
    } else {
        let middle: [f32; LANES] = middle(values).into();
        medians.copy_from_slice(&middle[..medians.len()]);
    }
}

/// The first values of a row; zeros beyond its end.
#[inline(always)]
fn chunk(row: &[f32]) -> [f32; LANES] {
    let mut values = [0.0; LANES];
    match row.first_chunk() {
        Some(row) => values = *row,
        None => values[..row.len()].copy_from_slice(row),
    }
    values
}

/// The medians of an odd number of values. Each round moves the least and greatest values to the ends and drops them.
#[inline(always)]
fn middle<S: Simd, const VALUES: usize>(mut values: [f32x16<S>; VALUES]) -> f32x16<S> {
    for first in 0..VALUES / 2 {
        let last = VALUES - 1 - first;
        sort(&mut values, first, last);
        for value in first + 1..last {
            sort(&mut values, first, value);
            sort(&mut values, value, last);
        }
    }
    values[VALUES / 2]
}

/// Not `min` and `max`, whose answers for 0 and -0 depend on the machine.
#[inline(always)]
fn sort<S: Simd>(values: &mut [f32x16<S>], low: usize, high: usize) {
    let (a, b) = (values[low], values[high]);
    let ascend = a.simd_lt(b);
    (values[low], values[high]) = (ascend.select(a, b), ascend.select(b, a));
}

/// The median of the known values in one window. An unknown pixel stays unknown.
fn of_known(values: impl Iterator<Item = f32>, own: f32) -> f32 {
    let mut known: Vec<f32> = values.filter(|value| value.is_finite()).collect();
    if known.is_empty() || !own.is_finite() {
        return own;
    }
    let middle = (known.len() - 1) / 2;
    *known.select_nth_unstable_by(middle, f32::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Size;
    use crate::never;

    const NONE: f32 = DisparityMap::UNKNOWN;

    /// A plain median, straight from the definition.
    fn plain(map: &DisparityMap, side: i64) -> Vec<f32> {
        let Size { width, height } = map.size();
        let near = |at: i64, end: usize| at.clamp(0, end as i64 - 1) as usize;
        let median = |i: usize| {
            let (x, y) = ((i % width) as i64, (i / width) as i64);
            let offsets = || -side / 2..=side / 2;
            let window = offsets().flat_map(|dy| offsets().map(move |dx| (dx, dy)));
            let mut known: Vec<f32> =
                window.filter_map(|(dx, dy)| map.at(near(x + dx, width), near(y + dy, height))).collect();
            known.sort_by(f32::total_cmp);
            if map.values()[i].is_finite() { known[(known.len() - 1) / 2] } else { NONE }
        };
        (0..width * height).map(median).collect()
    }

    #[test]
    #[cfg_attr(miri, ignore = "takes minutes")]
    fn medians_are_those_of_the_definition() {
        for (width, height) in [(1, 1), (2, 3), (17, 5), (40, 11)] {
            let noise = |i: usize| ((i * 7919 + i * i * 31) % 23) as f32 / 2.0 - 3.0;
            let value = |holes: bool| move |i: usize| if holes && i % 5 == 2 { NONE } else { noise(i) };
            for (side, holes) in MEDIANS.into_iter().flat_map(|side| [(side, false), (side, true)]) {
                let values = (0..width * height).map(value(holes)).collect();
                let map = DisparityMap::new(Size { width, height }, values).unwrap();
                let found = median(&map, side, &never).unwrap();
                assert_eq!(found.values(), plain(&map, side as i64), "{width}x{height}, {side}");
            }
        }
    }

    #[test]
    fn other_windows_are_refused() {
        let map = DisparityMap::new(Size { width: 1, height: 1 }, vec![1.0]).unwrap();
        assert!(median(&map, 4, &never).is_err() && median(&map, 0, &never).is_err());
    }
}
