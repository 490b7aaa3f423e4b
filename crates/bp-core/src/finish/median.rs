//! The median filter.

use super::{
    IsStopped, go_on,
    window::{Frame, Framed},
};
use crate::{DisparityMap, Error};

/// The window sides that [`median`] supports.
pub const MEDIANS: [usize; 3] = [3, 5, 7];

/// How many columns are sorted together.
const LANES: usize = 16;

/// One value from each of [`LANES`] windows.
type Lanes = [f32; LANES];

/// Replaces every known disparity by the median of the known ones in the `side` x `side` window around it. The border
/// repeats outward. The median of an even number of values is the smaller of the two in the middle.
///
/// # Errors
/// [`Error::Plan`] if `side` is not one of [`MEDIANS`], [`Error::OutOfMemory`], [`Error::Stopped`].
pub fn median(map: &DisparityMap, side: usize, is_stopped: IsStopped<'_>) -> Result<DisparityMap, Error> {
    if !MEDIANS.contains(&side) {
        return Err(Error::Plan("a median is over windows of 3, 5 or 7 pixels"));
    }
    let size = map.size();
    let framed = Framed::new(size, map.values(), side / 2, Frame::Repeated)?;
    let mut medians = map.values().to_vec();
    for (y, row) in medians.chunks_exact_mut(size.width).enumerate() {
        go_on(is_stopped)?;
        let windows: Vec<&[f32]> = (0..side * side).map(|index| framed.row(y, index % side, index / side)).collect();
        for (index, medians) in row.chunks_mut(LANES).enumerate() {
            chunk(&windows, index * LANES, medians);
        }
    }
    DisparityMap::new(size, medians)
}

/// The medians of the windows from column `start` on. `windows` holds a shifted row for every position in the window.
fn chunk(windows: &[&[f32]], start: usize, medians: &mut [f32]) {
    let mut values = [[0.0; LANES]; MEDIANS[MEDIANS.len() - 1] * MEDIANS[MEDIANS.len() - 1]];
    let values = &mut values[..windows.len()];
    let mut known = true;
    for (values, row) in values.iter_mut().zip(windows) {
        let row = &row[start..start + medians.len()];
        values[..row.len()].copy_from_slice(row);
        known &= row.iter().all(|value| value.is_finite());
    }
    if known {
        medians.copy_from_slice(&middle(values)[..medians.len()]);
    } else {
        medians.iter_mut().enumerate().for_each(|(lane, median)| *median = of_known(values, lane, *median));
    }
}

/// The medians of an odd number of values. Each round moves the least and greatest values to the ends and drops them.
fn middle(mut values: &mut [Lanes]) -> Lanes {
    while let [first, inner @ .., last] = values {
        sort(first, last);
        for value in &mut *inner {
            sort(first, value);
            sort(value, last);
        }
        if inner.is_empty() {
            return *first;
        }
        values = inner;
    }
    values.first().copied().unwrap_or([DisparityMap::UNKNOWN; LANES])
}

fn sort(low: &mut Lanes, high: &mut Lanes) {
    for (low, high) in low.iter_mut().zip(high) {
        // Not f32::min, which also handles NaN and is slower.
        (*low, *high) = if *low < *high { (*low, *high) } else { (*high, *low) };
    }
}

/// The median of the known values in one window. An unknown pixel stays unknown.
fn of_known(values: &[Lanes], lane: usize, own: f32) -> f32 {
    let mut known: Vec<f32> = values.iter().map(|values| values[lane]).filter(|value| value.is_finite()).collect();
    if known.is_empty() || !own.is_finite() {
        return own;
    }
    let middle = (known.len() - 1) / 2;
    *known.select_nth_unstable_by(middle, f32::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::{super::never, *};
    use crate::Size;

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
