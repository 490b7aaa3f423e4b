//! Removal of small surfaces, which are usually wrong.

use std::{mem, ops::Range};

use fearless_simd::{Level, Simd, SimdBase, SimdMask, dispatch, f32x8};
use rayon::prelude::*;

use super::check::AGREE;
use crate::{DisparityMap, Error, Size, memory};

/// Pixels that are compared in one step, and in one vector.
const TOGETHER: usize = 32;
const LANES: usize = 8;

/// Adjacent pixels of a row that belong to the same surface, as many as there are.
#[derive(Clone, Copy, Default)]
struct Run {
    /// The column of the first pixel. The row's next run begins after the last one.
    start: u32,
    /// An earlier run of the same surface, or this one. [`count`] replaces it: the surface's first run holds [`COUNTED`] and the number of
    /// pixels, and the others its index.
    before: u32,
}

/// Larger than the index of a run. Surfaces of so many pixels are counted no further.
const COUNTED: u32 = 1 << 31;

/// Makes surfaces of fewer than `least` pixels unknown; those of 2^31 or more always stay. A surface consists of adjacent pixels, each of
/// which differs from the next by no more than [`AGREE`].
///
/// # Errors
/// [`Error::OutOfMemory`].
pub fn remove_speckles(map: DisparityMap, least: usize) -> Result<DisparityMap, Error> {
    let (width, least) = (map.size().width, least.min(COUNTED as usize - 1));
    let (rows, mut runs) = joined_runs(map.values(), width)?;
    count(&rows, &mut runs, width);
    Ok(map.replaced(|values| {
        values.par_chunks_exact_mut(width).zip(&rows).for_each(|(values, row)| {
            for index in row.clone() {
                let Run { before, .. } = runs[index];
                let pixels = if before >= COUNTED { before } else { runs[before as usize].before } - COUNTED;
                if (pixels as usize) < least {
                    values[columns(&runs, row, index, width)].fill(DisparityMap::UNKNOWN);
                }
            }
        });
    }))
}

/// The temporary bytes of [`remove_speckles`] for a map of this size: at most one run a pixel.
#[must_use]
pub fn speckle_bytes(size: Size) -> u64 {
    (size.pixels() * size_of::<Run>() + size.height * size_of::<Range<usize>>()) as u64
}

/// Whether adjacent pixels belong to the same surface. Unknown ones form surfaces too, which stay unknown.
fn agree(a: f32, b: f32) -> bool {
    (a - b).abs() <= AGREE || a == b
}

/// The columns of a run, which is one of those of a row.
fn columns(runs: &[Run], row: &Range<usize>, index: usize, width: usize) -> Range<usize> {
    let end = if index + 1 < row.end { runs[index + 1].start as usize } else { width };
    runs[index].start as usize..end
}

/// Counts the pixels of joined runs.
fn count(rows: &[Range<usize>], runs: &mut [Run], width: usize) {
    for (index, row) in rows.iter().flat_map(|row| row.clone().map(move |index| (index, row))) {
        // Runs of a surface come after its first one, so each is one step away from it, if those before are.
        let before = runs[index].before;
        let above = runs[before as usize].before;
        let first = if before as usize == index || above >= COUNTED { before } else { above };
        runs[index].before = if first as usize == index { COUNTED } else { first };
        let pixels = columns(runs, row, index, width).len() as u32;
        let counted = &mut runs[first as usize].before;
        *counted = counted.saturating_add(pixels);
    }
}

/// The runs of all rows, joined with those above that they touch, and which runs belong to each row.
fn joined_runs(values: &[f32], width: usize) -> Result<(Vec<Range<usize>>, Vec<Run>), Error> {
    let rows = rows_of_runs(values, width)?;
    let (height, all) = (rows.len(), rows.last().map_or(0, |row| row.end));
    let mut runs = memory::filled("surfaces", all, Run::default())?;
    let together = height.div_ceil(rayon::current_num_threads());
    rayon::scope(|scope| {
        let mut rest = &mut runs[..];
        for (values, rows) in values.chunks(together * width).zip(rows.chunks(together)) {
            let first = rows[0].start;
            let (runs, others) = mem::take(&mut rest).split_at_mut(rows[rows.len() - 1].end - first);
            rest = others;
            scope.spawn(move |_| Part { values, width, rows, runs, first }.write());
        }
    });
    let mut all = Part { values, width, rows: &rows, runs: &mut runs, first: 0 };
    (together..height).step_by(together).for_each(|y| all.join(y));
    Ok((rows, runs))
}

/// Which runs belong to each row. They are counted before they are written, because one might be needed for each pixel.
fn rows_of_runs(values: &[f32], width: usize) -> Result<Vec<Range<usize>>, Error> {
    let level = Level::new();
    let mut rows = memory::filled("rows of a map", values.len() / width, 0..0)?;
    let by_row = rows.par_iter_mut().zip(values.par_chunks_exact(width));
    by_row.for_each(|(row, values)| row.end = dispatch!(level, simd => count_runs(simd, values)));
    let mut end = 0;
    for row in &mut rows {
        *row = end..end + row.end;
        end = row.end;
    }
    if end <= COUNTED as usize {
        return Ok(rows);
    }
    let [needed, available] = [end, COUNTED as usize].map(|runs| runs as u64 * size_of::<Run>() as u64);
    Err(Error::OutOfMemory { what: "surfaces", needed, available: Some(available) })
}

/// Some rows of a map.
struct Part<'a> {
    values: &'a [f32],
    width: usize,
    /// The runs of each row, counted from those of the map's first row.
    rows: &'a [Range<usize>],
    /// The runs of these rows, counted from `first`.
    runs: &'a mut [Run],
    first: usize,
}

impl Part<'_> {
    /// Finds the runs and joins them.
    fn write(mut self) {
        let level = Level::new();
        for (y, values) in self.values.chunks_exact(self.width).enumerate() {
            let row = self.row(y);
            dispatch!(level, simd => write_runs(simd, values, row.start as u32, &mut self.runs[row.clone()]));
            if y > 0 {
                self.join(y);
            }
        }
        for run in self.runs {
            run.before += self.first as u32;
        }
    }

    /// The runs of a row.
    fn row(&self, y: usize) -> Range<usize> {
        self.rows[y].start - self.first..self.rows[y].end - self.first
    }

    /// Joins the runs of row y with those of the row above.
    fn join(&mut self, y: usize) {
        let (above, own) = (self.row(y - 1), self.row(y));
        let [upper, lower] = [y - 1, y].map(|y| &self.values[y * self.width..][..self.width]);
        let mut next = above.clone();
        for index in own.clone() {
            let run = columns(self.runs, &own, index, self.width);
            while !next.is_empty() {
                let other = columns(self.runs, &above, next.start, self.width);
                let mut shared = run.start.max(other.start)..run.end.min(other.end);
                if shared.any(|x| agree(upper[x], lower[x])) {
                    let [a, b] = [index, next.start].map(|run| first(self.runs, run as u32));
                    self.runs[a.max(b) as usize].before = a.min(b);
                }
                if other.end > run.end {
                    break;
                }
                next.start += 1;
            }
        }
    }
}

/// The number of runs of a row.
#[inline(always)]
fn count_runs<S: Simd>(simd: S, row: &[f32]) -> usize {
    simd.vectorize(
        #[inline(always)]
        || {
            let mut count = 1;
            for (before, own) in row.chunks(TOGETHER).zip(row[1..].chunks(TOGETHER)) {
                count += steps(simd, before, own).count_ones() as usize;
            }
            count
        },
    )
}

/// Writes the runs of a row, whose indices begin with `index`.
#[inline(always)]
fn write_runs<S: Simd>(simd: S, row: &[f32], index: u32, runs: &mut [Run]) {
    simd.vectorize(
        #[inline(always)]
        || {
            runs[0] = Run { start: 0, before: index };
            let mut places = (index + 1..).zip(&mut runs[1..]);
            for (first, (before, own)) in
                (1..).step_by(TOGETHER).zip(row.chunks(TOGETHER).zip(row[1..].chunks(TOGETHER)))
            {
                let mut steps = steps(simd, before, own);
                while steps != 0 {
                    if let Some((before, run)) = places.next() {
                        *run = Run { start: first + steps.trailing_zeros(), before };
                    }
                    steps &= steps - 1;
                }
            }
        },
    );
}

/// Which of up to [`TOGETHER`] pixels of a row are the first of a run, as bits. `before` are those before them, and maybe one more.
#[inline(always)]
fn steps<S: Simd>(simd: S, before: &[f32], own: &[f32]) -> u32 {
    let whole = |values: &[f32]| {
        let mut whole = [0.0; TOGETHER];
        whole[..own.len()].copy_from_slice(&values[..own.len()]);
        whole
    };
    match (before.first_chunk(), own.first_chunk()) {
        (Some(before), Some(own)) => steps_of_all(simd, before, own),
        _ => steps_of_all(simd, &whole(before), &whole(own)),
    }
}

#[inline(always)]
fn steps_of_all<S: Simd>(simd: S, before: &[f32; TOGETHER], own: &[f32; TOGETHER]) -> u32 {
    let most = f32x8::splat(simd, AGREE);
    let mut steps = 0;
    for first in (0..TOGETHER).step_by(LANES) {
        let before = f32x8::from_slice(simd, &before[first..first + LANES]);
        let own = f32x8::from_slice(simd, &own[first..first + LANES]);
        let agree = (before - own).abs().simd_le(most) | before.simd_eq(own);
        steps |= ((!agree).to_bitmask() as u32) << first;
    }
    steps
}

/// The first run of the surface that a run belongs to, as far as it is joined.
fn first(runs: &mut [Run], mut run: u32) -> u32 {
    while runs[run as usize].before != run {
        // Every second step becomes one of two, so that paths stay short.
        let before = runs[run as usize].before;
        runs[run as usize].before = runs[before as usize].before;
        run = runs[run as usize].before;
    }
    run
}

#[cfg(test)]
mod tests {
    use super::*;

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
            for (least, threads) in [(2, 1), (5, 2), (5, 3), (12, 8)] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                let left = pool.install(|| remove_speckles(map.clone(), least)).unwrap();
                for (pixel, (&left, &value)) in left.values().iter().zip(map.values()).enumerate() {
                    let expected = if flooded(&map, pixel).len() < least { NONE } else { value };
                    assert_eq!(left, expected, "{width}x{height}, {least}, pixel {pixel}");
                }
            }
        }
    }
}
