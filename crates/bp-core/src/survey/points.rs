//! Matches a few hundred points again at full resolution, also above and below their rows.

use std::ops::Range;

use fearless_simd::{Level, Simd, dispatch};
use rayon::prelude::*;

use super::coarse::{Found, Matches};
use crate::{Image, StereoPair, image::grey};

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
#[derive(Clone, Copy)]
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

/// The disparities of coarse matches at full resolution.
pub(super) fn disparities(pair: &StereoPair, found: &[Found], rows_down: isize, factor: usize) -> Vec<i32> {
    let places: Vec<Place> = found.iter().map(|&found| Place::of(found, factor)).collect();
    let reach = factor * (1 + rows_down.unsigned_abs());
    let points = dispatch!(Level::new(), simd => points(simd, pair, &places, factor, reach));
    points.iter().map(|point| point.x as i32 - point.column as i32).collect()
}

/// In each cell of the small image, the match with the most contrast between the rows above and below.
fn places(small: &Image, look: &Matches, factor: usize) -> Vec<Place> {
    let cells = small.size().width.div_ceil(CELL);
    let mut best: Vec<Option<(u16, usize, usize, i32)>> = vec![None; cells * small.size().height.div_ceil(CELL)];
    for (x, y, disparity) in look.found() {
        let cell = &mut best[(y / CELL) * cells + x / CELL];
        let contrast = contrast(small, x, y);
        if cell.is_none_or(|(most, ..)| contrast > most) {
            *cell = Some((contrast, x, y, disparity));
        }
    }
    best.into_iter().flatten().map(|(_, x, y, disparity)| Place::of((x, y, disparity), factor)).collect()
}

/// The sum of differences between the three pixels above and the three below.
fn contrast(small: &Image, x: usize, y: usize) -> u16 {
    let [above, below] = [-1, 1].map(|dy| small.row_near(y as isize + dy));
    let columns = x.saturating_sub(1)..(x + 2).min(above.len());
    let pairs = above[columns.clone()].iter().zip(&below[columns]);
    pairs.map(|(&above, &below)| u16::from(grey(above).abs_diff(grey(below)))).sum()
}

/// Matches some places.
#[inline(always)]
fn points<S: Simd>(simd: S, pair: &StereoPair, places: &[Place], factor: usize, reach: usize) -> Vec<Point> {
    simd.vectorize(
        #[inline(always)]
        || {
            let mut points = Vec::with_capacity(places.len());
            let (mut window, mut strips) = (Codes::default(), Codes::default());
            for &place in places {
                points.extend(point(pair, place, factor, reach, [&mut window, &mut strips]));
            }
            points
        },
    )
}

/// Compares the window of a place with those within `factor` columns and `reach` rows; `None` if one leaves its image.
#[inline(always)]
fn point(
    pair: &StereoPair,
    Place { x, y, column }: Place,
    factor: usize,
    reach: usize,
    [window, strips]: [&mut Codes; 2],
) -> Option<Point> {
    let (half_width, half_height) = (WINDOW_WIDTH / 2, WINDOW_HEIGHT / 2);
    let (left, top) = (x.checked_sub(half_width)?, y.checked_sub(half_height + reach)?);
    let first = usize::try_from(column - (half_width + factor) as i64).ok()?;
    let middle = top + reach..top + reach + WINDOW_HEIGHT;
    window.read(pair.left(), left..left + WINDOW_WIDTH, middle)?;
    strips.read(pair.right(), first..first + 2 * factor + WINDOW_WIDTH, top..top + 2 * reach + WINDOW_HEIGHT)?;
    let mut costs = vec![u32::MAX; 2 * reach + 1];
    let mut best = (u32::MAX, 0, 0, 0);
    for (down, cost) in costs.iter_mut().enumerate() {
        for across in 0..=2 * factor {
            let mut differing = 0;
            for row in 0..WINDOW_HEIGHT {
                differing += (strips.word(down + row, across) ^ window.word(row, 0)).count_ones();
            }
            *cost = differing.min(*cost);
            best = best.min((differing, reach.abs_diff(down), down, across));
        }
    }
    let (_, _, down, across) = best;
    Some(Point { x, y, column: first + half_width + across, row: y + down - reach, costs })
}

/// The census codes of a rectangle; see [`crate::census::code`].
#[derive(Default)]
struct Codes {
    columns: usize,
    greys: Vec<u8>,
    codes: Vec<u8>,
}

impl Codes {
    /// Reads the codes at some columns and rows; `None` if they leave the image.
    #[inline(always)]
    fn read(&mut self, image: &Image, columns: Range<usize>, rows: Range<usize>) -> Option<()> {
        let (size, wide) = (image.size(), columns.len() + 2);
        if columns.start == 0 || rows.start == 0 || columns.end >= size.width || rows.end >= size.height {
            return None;
        }
        self.columns = columns.len();
        self.greys.resize(wide * (rows.len() + 2), 0);
        for (row, greys) in (rows.start - 1..).zip(self.greys.chunks_exact_mut(wide)) {
            let pixels = &image.pixels()[row * size.width..][columns.start - 1..=columns.end];
            for (out, &pixel) in greys.iter_mut().zip(pixels) {
                *out = grey(pixel);
            }
        }
        self.codes.clear();
        self.codes.resize(columns.len() * rows.len(), 0);
        for (rows, codes) in self.greys.windows(3 * wide).step_by(wide).zip(self.codes.chunks_exact_mut(columns.len()))
        {
            write_codes(rows, codes);
        }
        Some(())
    }

    /// The codes of [`WINDOW_WIDTH`] pixels.
    #[inline(always)]
    fn word(&self, row: usize, column: usize) -> u64 {
        let codes = &self.codes[row * self.columns + column..][..WINDOW_WIDTH];
        codes.try_into().map_or(0, u64::from_le_bytes)
    }
}

/// Writes the codes of the middle one of three rows.
#[inline(always)]
fn write_codes(rows: &[u8], codes: &mut [u8]) {
    let wide = codes.len() + 2;
    let centres = &rows[wide + 1..][..codes.len()];
    for (bit, (dx, dy)) in (0..8).zip([(0, 0), (1, 0), (2, 0), (0, 1), (2, 1), (0, 2), (1, 2), (2, 2)]) {
        let others = &rows[dy * wide + dx..][..codes.len()];
        for ((code, other), centre) in codes.iter_mut().zip(others).zip(centres) {
            *code |= u8::from(other > centre) << bit;
        }
    }
}
