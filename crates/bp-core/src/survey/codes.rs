//! Census codes of rectangles at full resolution.

use std::ops::Range;

use crate::Image;

/// Grey values that are read together, and the codes that they make.
const GREYS: usize = 32;
const CODES: usize = GREYS - 2;

/// Codes after those of a row that mean nothing. So a vector that begins inside the rectangle can be loaded as a whole.
pub(super) const SPARE: usize = 32;

/// [`GREYS`] values, and two more that mean nothing.
type Run = [u8; GREYS + 2];

/// The census codes of a rectangle; see [`crate::census::code`].
#[derive(Default)]
pub(super) struct Codes {
    /// The columns of the rectangle, rounded up to whole runs, and [`SPARE`] more.
    columns: usize,
    /// A run of each row, and of those above and below the rectangle.
    greys: Vec<Run>,
    codes: Vec<u8>,
}

impl Codes {
    /// Reads the codes at some columns and rows; `None` if they leave the image.
    #[inline(always)]
    pub(super) fn read(&mut self, image: &Image, columns: Range<usize>, rows: Range<usize>) -> Option<()> {
        let size = image.size();
        if columns.start == 0 || rows.start == 0 || columns.end >= size.width || rows.end >= size.height {
            return None;
        }
        let read = columns.len().next_multiple_of(CODES);
        self.columns = read + SPARE;
        self.greys.resize(rows.len() + 2, [0; GREYS + 2]);
        self.codes.resize(self.columns * rows.len(), 0);
        for first in (0..read).step_by(CODES) {
            let start = columns.start - 1 + first;
            for (row, greys) in (rows.start - 1..).zip(&mut self.greys) {
                *greys = run_of_greys(&image.greys()[row * size.width + start..]);
            }
            let codes = self.codes.chunks_exact_mut(self.columns);
            for (rows, codes) in self.greys.windows(3).zip(codes) {
                codes[first..first + CODES].copy_from_slice(&run_of_codes([&rows[0], &rows[1], &rows[2]])[..CODES]);
            }
        }
        Some(())
    }

    /// The codes of a row from a column on, with what comes after them.
    #[inline(always)]
    pub(super) fn row(&self, row: usize, column: usize) -> &[u8] {
        &self.codes[row * self.columns + column..(row + 1) * self.columns]
    }
}

/// The grey values of some pixels; zeros beyond the last one.
#[inline(always)]
fn run_of_greys(values: &[u8]) -> Run {
    let mut greys = [0; GREYS + 2];
    // A known number of values takes vectors.
    match values.first_chunk::<GREYS>() {
        Some(values) => greys[..GREYS].copy_from_slice(values),
        None => greys[..values.len()].copy_from_slice(values),
    }
    greys
}

/// The codes of the middle one of three rows, without its ends. The last two mean nothing.
#[inline(always)]
fn run_of_codes(rows: [&Run; 3]) -> [u8; GREYS] {
    let mut codes = [0; GREYS];
    for (bit, (dx, dy)) in (0..8).zip([(0, 0), (1, 0), (2, 0), (0, 1), (2, 1), (0, 2), (1, 2), (2, 2)]) {
        for ((code, other), centre) in codes.iter_mut().zip(&rows[dy][dx..dx + GREYS]).zip(&rows[1][1..]) {
            *code |= u8::from(other > centre) << bit;
        }
    }
    codes
}
