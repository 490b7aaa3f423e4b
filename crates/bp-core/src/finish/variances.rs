//! Variances of grey differences in windows, from sums that rows enter and leave.

use std::ops::Range;

use crate::{Error, memory::Buffer};

/// How far windows reach from their centres.
pub(super) const REACH: usize = 3;
pub(super) const SIDE: usize = 2 * REACH + 1;

/// Rows have room for a multiple of so many columns.
pub(super) const LANES: usize = 8;

/// What happens to a row as windows move down an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Turn {
    /// It comes into the windows.
    Enter(usize),
    /// All rows of the windows around it are there.
    Middle(usize),
    /// It is in no more windows.
    Leave(usize),
}

/// The turns of rows, so that some of them are in the middle one after another.
pub(super) fn turns(rows: Range<usize>, height: usize) -> impl Iterator<Item = Turn> {
    let coming = rows.start.saturating_sub(REACH)..rows.end + REACH;
    coming.flat_map(move |coming| {
        let middle = coming.checked_sub(REACH).filter(|middle| rows.contains(middle));
        let enter = (coming < height).then_some(Turn::Enter(coming));
        let leave = middle.and_then(|middle| middle.checked_sub(REACH)).map(Turn::Leave);
        [enter, middle.map(Turn::Middle), leave].into_iter().flatten()
    })
}

/// The differences in the rows of windows whose centres lie in one row. Each pixel has one or several: those at the disparities
/// that are tried.
pub(super) struct Variances {
    width: usize,
    tried: usize,
    /// How many rows there are.
    rows: usize,
    /// Grey differences, `[row mod 7][tried][column]`. Rows have [`REACH`] more columns on both sides, with zeros.
    differences: Buffer<i16>,
    /// Sums of the differences in each column, and of their squares, `[tried][column]`.
    sums: Buffer<i32>,
    squares: Buffer<i32>,
    /// The variances in the windows around a row, times their pixels, `[tried][column]`.
    variances: Buffer<f32>,
}

impl Variances {
    pub(super) fn new(width: usize, tried: usize) -> Result<Self, Error> {
        let (what, all) = ("grey differences", tried * wide(width));
        Ok(Self {
            width,
            tried,
            rows: 0,
            differences: Buffer::filled(what, SIDE * all, 0)?,
            sums: Buffer::filled(what, all, 0)?,
            squares: Buffer::filled(what, all, 0)?,
            variances: Buffer::filled(what, tried * width, 0.0)?,
        })
    }

    /// The bytes that they take for rows of this width.
    pub(super) fn bytes(width: usize, tried: usize) -> u64 {
        let of = |len: usize, bytes: usize| len as u64 * bytes as u64;
        let all = tried * wide(width);
        of(SIDE * all, 2) + of(2 * all, 4) + of(tried * width, 4)
    }

    /// The differences of row y at each tried disparity, `[tried][column]`, to be written before it enters. A multiple of [`LANES`]
    /// columns.
    #[inline(always)]
    pub(super) fn differences_mut(&mut self, y: usize) -> impl Iterator<Item = &mut [i16]> {
        let all = self.tried * wide(self.width);
        let rows = self.differences[(y % SIDE) * all..][..all].chunks_exact_mut(wide(self.width));
        rows.map(|row| {
            let end = row.len() - REACH;
            &mut row[REACH..end]
        })
    }

    /// Adds row y.
    #[inline(always)]
    pub(super) fn enter(&mut self, y: usize) {
        self.rows += 1;
        self.add::<1>(y);
    }

    /// Removes row y.
    #[inline(always)]
    pub(super) fn leave(&mut self, y: usize) {
        self.rows -= 1;
        self.add::<-1>(y);
    }

    #[inline(always)]
    fn add<const SIGN: i32>(&mut self, y: usize) {
        let all = self.tried * wide(self.width);
        let row = &self.differences[(y % SIDE) * all..][..all];
        for ((&difference, sum), square) in row.iter().zip(&mut self.sums).zip(&mut self.squares) {
            let difference = i32::from(difference);
            *sum += SIGN * difference;
            *square += SIGN * difference * difference;
        }
    }

    /// The variances in the windows around the row in the middle, times their pixels, `[tried][column]`.
    #[inline(always)]
    pub(super) fn compute(&mut self) -> &[f32] {
        let (width, wide, rows) = (self.width, wide(self.width), self.rows as f32);
        // A product takes less time than a quotient.
        let shared = 1.0 / (rows * SIDE as f32);
        for (step, variances) in self.variances.chunks_exact_mut(width).enumerate() {
            let [sums, squares] = [&self.sums, &self.squares].map(|all| &all[step * wide..][..wide]);
            let windows = sums.windows(SIDE).zip(squares.windows(SIDE));
            for (variance, (sums, squares)) in variances.iter_mut().zip(windows) {
                let [sum, square] = [sums, squares].map(|values| values.iter().sum::<i32>() as f32);
                *variance = square - sum * sum * shared;
            }
            // The windows at the borders have fewer columns.
            for x in (0..REACH.min(width)).chain(width.saturating_sub(REACH).max(REACH.min(width))..width) {
                let columns = width.min(x + REACH + 1) - x.saturating_sub(REACH);
                let [sum, square] = [sums, squares].map(|all| all[x..x + SIDE].iter().sum::<i32>() as f32);
                variances[x] = square - sum * sum / (rows * columns as f32);
            }
        }
        &self.variances
    }
}

/// A row of sums for one tried disparity: columns, and [`REACH`] more on both sides.
fn wide(width: usize) -> usize {
    width.next_multiple_of(LANES) + 2 * REACH
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_in_the_middle_of_all_that_their_windows_reach() {
        for (rows, height) in [(0..1, 1), (0..4, 9), (4..9, 9), (20..60, 100), (0..100, 100)] {
            let (mut inside, mut next) = (Vec::new(), rows.start);
            for turn in turns(rows.clone(), height) {
                match turn {
                    Turn::Enter(y) => inside.push(y),
                    Turn::Leave(y) => assert_eq!(inside.remove(0), y),
                    Turn::Middle(y) => {
                        assert_eq!(inside, (y.saturating_sub(REACH)..height.min(y + REACH + 1)).collect::<Vec<_>>());
                        assert_eq!(y, next);
                        next += 1;
                    }
                }
            }
            assert_eq!(next, rows.end);
        }
    }
}
