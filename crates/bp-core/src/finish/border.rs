//! Filling the left border, which the right camera does not see.

use std::{array, ops::RangeInclusive};

use fearless_simd::{Level, Select, Simd, SimdBase, SimdMask, dispatch, f32x8};
use rayon::prelude::*;

use super::check::AGREE;
use crate::{DisparityMap, Error, Size, memory};

/// How many rows above and below, and how many columns, a slope is estimated from.
const ROWS: usize = 16;
const COLUMNS: usize = 24;

/// These columns in vectors.
const LANES: usize = 8;
const VECTORS: usize = COLUMNS / LANES;

/// The shortest run of columns that is used.
const FEWEST: usize = 8;

/// The steepest slope, in pixels of disparity a column.
const STEEPEST: f64 = 0.5;

/// The share of the slope that is continued. Beyond the known pixels, surfaces tend to be flatter.
const CONTINUED: f64 = 0.75;

/// Fills unknown pixels at the left border. In each row, the surface that begins right of them is extended to the left with its
/// slope, in `whole` pixels or fractions. A row without any known pixel stays unknown.
///
/// The first known pixel of a row is its anchor. In the 16 rows above and below, and in its own, a run of up to 24 pixels begins
/// in the anchor's column if the disparity there differs from the anchor's by at most 1 px; it ends before an unknown pixel or
/// a step of more than 1 px. A line is fitted to all runs of at least 8 pixels, each about its own mean. Three quarters of its
/// slope, at most half a pixel a column, lead from the anchor towards the border, over as many columns as the anchor's
/// disparity: so wide is the strip that the right camera does not see. The disparity then stays. So does the range of disparities.
///
/// # Errors
/// [`Error::OutOfMemory`].
pub fn fill_border(map: DisparityMap, whole: bool) -> Result<DisparityMap, Error> {
    let Some((least, largest)) = map.range_by_threads() else { return Ok(map) };
    let (Size { width, height }, level) = (map.size(), Level::new());
    let mut anchors = memory::filled("anchors", height, None)?;
    anchors.par_iter_mut().enumerate().for_each(|(y, anchor)| {
        let x = map.values()[y * width..][..width].iter().position(|value| value.is_finite());
        *anchor = x.filter(|&x| x > 0).map(|x| (x, dispatch!(level, simd => slope(simd, &map, x, y))));
    });
    Ok(map.replaced(|values| {
        values.par_chunks_exact_mut(width).zip(anchors).for_each(|(row, anchor)| {
            if let Some((x, slope)) = anchor {
                extend(row, x, slope, least..=largest, whole);
            }
        });
    }))
}

/// Extends the surface at column x of a row to the left.
fn extend(row: &mut [f32], x: usize, slope: f64, limits: RangeInclusive<f32>, whole: bool) {
    let (hole, known) = row.split_at_mut(x);
    let hidden = f64::from(known[0]).max(0.0);
    for (away, value) in (1_u32..).zip(hole.iter_mut().rev()) {
        let continued = f64::from(known[0]) - slope * f64::from(away).min(hidden);
        let continued = if whole { continued.round() } else { continued };
        *value = (continued as f32).clamp(*limits.start(), *limits.end());
    }
}

/// The slope to be continued to the left of the anchor at (x, y).
#[inline(always)]
fn slope<S: Simd>(simd: S, map: &DisparityMap, x: usize, y: usize) -> f64 {
    simd.vectorize(
        #[inline(always)]
        || {
            let Size { width, height } = map.size();
            let anchor = map.values()[y * width + x];
            let (mut rise, mut spread) = (f32x8::splat(simd, 0.0), 0.0);
            for row in map.values().chunks_exact(width).take(height.min(y + ROWS + 1)).skip(y.saturating_sub(ROWS)) {
                if (row[x] - anchor).abs() <= AGREE {
                    let near = Near::new(simd, &row[x..]);
                    let len = near.run();
                    if len >= FEWEST {
                        rise += near.rise(anchor, len);
                        let count = len as f64;
                        spread += count * (count * count - 1.0) / 12.0;
                    }
                }
            }
            let rise: f32 = rise.as_slice().iter().sum();
            if spread > 0.0 { (CONTINUED * f64::from(rise) / spread).clamp(-STEEPEST, STEEPEST) } else { 0.0 }
        },
    )
}

/// The values of [`COLUMNS`] columns, and each one's next.
struct Near<S: Simd> {
    simd: S,
    values: [f32x8<S>; VECTORS],
    next: [f32x8<S>; VECTORS],
}

impl<S: Simd> Near<S> {
    /// The first ones of a row. Those beyond its end count as unknown.
    #[inline(always)]
    fn new(simd: S, row: &[f32]) -> Self {
        let rest = || array::from_fn(|i| row.get(i).copied().unwrap_or(DisparityMap::UNKNOWN));
        let own: [f32; COLUMNS + 1] = row.first_chunk().copied().unwrap_or_else(rest);
        let load = |first: usize| array::from_fn(|i| f32x8::from_slice(simd, &own[first + i * LANES..][..LANES]));
        Self { simd, values: load(0), next: load(1) }
    }

    /// The number of values before the first step of more than 1 px, or the first unknown value.
    #[inline(always)]
    fn run(&self) -> usize {
        let most = f32x8::splat(self.simd, AGREE);
        let mut goes_on = 0;
        for (i, (&value, &next)) in self.values.iter().zip(&self.next).enumerate() {
            goes_on |= (next - value).abs().simd_le(most).to_bitmask() << (i * LANES);
        }
        (goes_on.trailing_ones() as usize + 1).min(COLUMNS)
    }

    /// The sum of the first `len` values times their columns, which are counted from the middle one. What the values are compared
    /// with does not change it; near them, sums stay small, and those of whole disparities are exact.
    #[inline(always)]
    fn rise(&self, anchor: f32, len: usize) -> f32x8<S> {
        let [anchor, middle, end, none] =
            [anchor, (len - 1) as f32 / 2.0, len as f32, 0.0].map(|value| f32x8::splat(self.simd, value));
        let mut rise = none;
        for (i, &values) in self.values.iter().enumerate() {
            let columns = f32x8::from_fn(self.simd, |lane| (i * LANES + lane) as f32);
            rise += columns.simd_lt(end).select((columns - middle) * (values - anchor), none);
        }
        rise
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Size;

    const NONE: f32 = DisparityMap::UNKNOWN;

    fn filled(width: usize, values: Vec<f32>) -> Vec<f32> {
        filled_in(width, values, true)
    }

    fn filled_in(width: usize, values: Vec<f32>, whole: bool) -> Vec<f32> {
        let size = Size { width, height: values.len() / width };
        fill_border(DisparityMap::new(size, values).unwrap(), whole).unwrap().values().to_vec()
    }

    #[test]
    fn fractions_go_on_in_fractions() {
        let known = (0..34).map(|x| if x < 4 { NONE } else { 20.0 + 0.4 * x as f32 });
        let row = filled_in(34, known.chain([2.0; 34]).collect(), false);
        for (x, expected) in [20.4, 20.7, 21.0, 21.3, 21.6].into_iter().enumerate() {
            assert!((row[x] - expected).abs() < 1e-4, "{x}: {}", row[x]);
        }
    }

    #[test]
    fn a_slope_goes_on_at_three_quarters() {
        // 4 px more with each 10 columns, so 3 px less with each 10 columns into the hole. The row below is farther away.
        let known = (0..34).map(|x| if x < 10 { NONE } else { (20.0 + 0.4 * x as f32).round() });
        let rows = filled(34, known.chain([2.0; 34]).collect());
        assert_eq!(rows[..11], [21.0, 21.0, 22.0, 22.0, 22.0, 23.0, 23.0, 23.0, 23.0, 24.0, 24.0]);
        // It never leaves the range of the known disparities.
        assert_eq!(filled(34, rows[..34].iter().map(|&d| if d < 24.0 { NONE } else { d }).collect())[..9], [24.0; 9]);
    }

    #[test]
    fn steps_short_runs_and_other_surfaces_tell_nothing() {
        // Seven columns, then a step.
        let mut row = vec![NONE; 4];
        row.extend((0..7).map(|x| 10.0 + x as f32).chain([40.0; 20]));
        assert_eq!(filled(31, row)[..4], [10.0; 4]);
        // The row below belongs to another surface.
        let flat = [NONE, NONE].into_iter().chain([9.0; 20]);
        let steep = (0..22).map(|x| if x < 2 { NONE } else { 30.0 + x as f32 });
        let both = filled(22, flat.chain(steep).collect());
        assert_eq!([both[0], both[22]], [9.0, 31.0]);
    }

    #[test]
    fn beyond_the_hidden_strip_the_disparity_stays() {
        let row: Vec<f32> =
            (0..60).map(|x| if x < 30 { NONE } else { (2.0 + 0.4 * (x - 30) as f32).round() }).collect();
        let rows = filled(60, row.into_iter().chain([0.0; 60]).collect());
        assert_eq!((rows[30], rows[29], rows[28], rows[0]), (2.0, 2.0, 1.0, 1.0));
    }

    #[test]
    fn only_the_left_border_is_filled() {
        let map = vec![5.0, NONE, 6.0, NONE];
        assert_eq!(filled(4, map.clone()), map);
        assert_eq!(filled(2, vec![NONE; 4]), [NONE; 4]);
    }
}
