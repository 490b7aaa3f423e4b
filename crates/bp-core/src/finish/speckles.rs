//! Removal of small surfaces, which are usually wrong.

use std::ops::Range;

use fearless_simd::{Level, Simd, SimdBase, SimdMask, dispatch, f32x8};

use super::check::AGREE;
use crate::{DisparityMap, Error};

/// Pixels that are compared at once.
const LANES: usize = 8;

/// Adjacent pixels of a row that belong to the same surface, as many as there are.
struct Run {
    /// The first pixel. The next run begins after the last one.
    start: usize,
    /// An earlier run of the same surface, or this one.
    before: usize,
}

/// Makes surfaces of fewer than `least` pixels unknown. A surface consists of adjacent pixels, each of which differs from
/// the next by no more than [`AGREE`].
///
/// # Errors
/// [`Error::OutOfMemory`].
pub fn remove_speckles(map: DisparityMap, least: usize) -> Result<DisparityMap, Error> {
    let (width, pixels) = (map.size().width, map.size().pixels());
    let mut runs = joined_runs(map.values(), width)?;
    // Runs of a surface come after its first one, so each is one step away from it, if those before are. From now on, the
    // first one holds the number of pixels, added to that of the image.
    for index in 0..runs.len() {
        let before = runs[index].before;
        let first = if before == index || runs[before].before >= pixels { before } else { runs[before].before };
        runs[index].before = if first == index { pixels } else { first };
        runs[first].before += end(&runs, index, pixels) - runs[index].start;
    }
    let count = |run: &Run| (if run.before >= pixels { run.before } else { runs[run.before].before }) - pixels;
    Ok(map.replaced(|values| {
        for (index, run) in runs.iter().enumerate().filter(|(_, run)| count(run) < least) {
            values[run.start..end(&runs, index, pixels)].fill(DisparityMap::UNKNOWN);
        }
    }))
}

/// Whether adjacent pixels belong to the same surface. Unknown ones form surfaces too, which stay unknown.
fn agree(a: f32, b: f32) -> bool {
    (a - b).abs() <= AGREE || a == b
}

/// The runs of all rows, joined with those above that they touch.
fn joined_runs(values: &[f32], width: usize) -> Result<Vec<Run>, Error> {
    let mut runs = Vec::new();
    // Hardly ever are there so many, but memory that is not used is not held.
    let needed = (values.len() as u64).saturating_mul(size_of::<Run>() as u64);
    let refused = |_| Error::OutOfMemory { what: "surfaces", needed, available: None };
    runs.try_reserve_exact(values.len()).map_err(refused)?;
    let (mut above, level) = (0..0, Level::new());
    for (start, row) in (0..).step_by(width).zip(values.chunks_exact(width)) {
        let own = runs.len();
        dispatch!(level, simd => push_runs(simd, start, row, &mut runs));
        let own = own..runs.len();
        join(values, width, &mut runs, above, own.clone());
        above = own;
    }
    Ok(runs)
}

/// Adds the runs of a row, whose first pixel is `start`.
#[inline(always)]
fn push_runs<S: Simd>(simd: S, start: usize, row: &[f32], runs: &mut Vec<Run>) {
    simd.vectorize(
        #[inline(always)]
        || {
            let most = f32x8::splat(simd, AGREE);
            let mut push = |start| runs.push(Run { start, before: runs.len() });
            push(start);
            let pieces = row.chunks(LANES).zip(row[1..].chunks(LANES));
            for (first, (before, own)) in (start + 1..).step_by(LANES).zip(pieces) {
                let [before, own] = [&before[..own.len()], own].map(|values| lanes(simd, values));
                let agree = (before - own).abs().simd_le(most) | before.simd_eq(own);
                let mut steps = (!agree).to_bitmask();
                while steps != 0 {
                    push(first + steps.trailing_zeros() as usize);
                    steps &= steps - 1;
                }
            }
        },
    );
}

/// At most [`LANES`] values, and zeros where there are fewer.
#[inline(always)]
fn lanes<S: Simd>(simd: S, values: &[f32]) -> f32x8<S> {
    match values.first_chunk() {
        Some(values) => f32x8::load_array(simd, *values),
        None => f32x8::from_fn(simd, |lane| values.get(lane).copied().unwrap_or(0.0)),
    }
}

/// Joins the runs of a row, which are the last ones, with those of the row above.
fn join(values: &[f32], width: usize, runs: &mut [Run], mut above: Range<usize>, own: Range<usize>) {
    let row_end = runs[own.start].start + width;
    for index in own {
        let (start, end) = (runs[index].start, end(runs, index, row_end));
        while !above.is_empty() {
            let (other_start, other_end) = (runs[above.start].start + width, runs[above.start + 1].start + width);
            if (start.max(other_start)..end.min(other_end)).any(|pixel| agree(values[pixel - width], values[pixel])) {
                let [a, b] = [index, above.start].map(|run| first(runs, run));
                runs[a.max(b)].before = a.min(b);
            }
            if other_end > end {
                break;
            }
            above.start += 1;
        }
    }
}

/// Where a run ends, if the last one ends at `last`.
fn end(runs: &[Run], index: usize, last: usize) -> usize {
    runs.get(index + 1).map_or(last, |next| next.start)
}

/// The first run of the surface that a run belongs to, as far as it is joined.
fn first(runs: &mut [Run], mut run: usize) -> usize {
    while runs[run].before != run {
        // Every second step becomes one of two, so that paths stay short.
        runs[run].before = runs[runs[run].before].before;
        run = runs[run].before;
    }
    run
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Size;

    const NONE: f32 = DisparityMap::UNKNOWN;

    #[test]
    fn surfaces_join_over_sides_and_small_steps() {
        let values = vec![
            1.0, 2.0, 9.0, //
            5.0, 3.0, NONE, //
            1.0, 5.0, 9.0,
        ];
        let map = DisparityMap::new(Size { width: 3, height: 3 }, values).unwrap();
        let left = remove_speckles(map.clone(), 3).unwrap();
        assert_eq!(left.values(), [1.0, 2.0, NONE, NONE, 3.0, NONE, NONE, NONE, NONE]);
        assert_eq!(remove_speckles(map.clone(), 1).unwrap(), map);
    }

    /// The surface that a pixel belongs to, found by going from neighbour to neighbour.
    fn flooded(map: &DisparityMap, start: usize) -> Vec<usize> {
        let (Size { width, height }, values) = (map.size(), map.values());
        let mut surface = vec![start];
        let mut next = 0;
        while let Some(&pixel) = surface.get(next) {
            next += 1;
            let (x, y) = (pixel % width, pixel / width);
            let sides = [
                (x > 0, pixel.wrapping_sub(1)),
                (x + 1 < width, pixel + 1),
                (y > 0, pixel.wrapping_sub(width)),
                (y + 1 < height, pixel + width),
            ];
            for (_, other) in sides.into_iter().filter(|(exists, _)| *exists) {
                if !surface.contains(&other) && (values[other] - values[pixel]).abs() <= AGREE {
                    surface.push(other);
                }
            }
        }
        surface
    }

    #[test]
    #[cfg_attr(miri, ignore = "takes minutes")]
    fn surfaces_of_any_form_count_as_a_whole() {
        let mut seed = 1_u32;
        let mut random = |values: u32| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 24) % values
        };
        for (width, height) in [(1, 1), (1, 9), (9, 1), (7, 5), (12, 20), (23, 17)].repeat(5) {
            let value = |_| if random(5) == 0 { NONE } else { 2.5 * random(3) as f32 };
            let values = (0..width * height).map(value).collect();
            let map = DisparityMap::new(Size { width, height }, values).unwrap();
            for least in [2, 5, 12] {
                let left = remove_speckles(map.clone(), least).unwrap();
                for (pixel, (&left, &value)) in left.values().iter().zip(map.values()).enumerate() {
                    let expected = if flooded(&map, pixel).len() < least { NONE } else { value };
                    assert_eq!(left, expected, "{width}x{height}, {least}, pixel {pixel}");
                }
            }
        }
    }
}
