//! Variances of grey differences in windows, from sums that rows enter and leave.

use std::ops::Range;

use crate::{Error, Size, memory::Buffer};

/// How far windows reach from their centres.
pub(super) const REACH: usize = 3;
pub(super) const SIDE: usize = 2 * REACH + 1;

/// Rows have room for a multiple of so many columns.
pub(super) const LANES: usize = 8;

/// What happens to a row as windows move down an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Turn {
    /// It comes into the windows, and the row that is [`SIDE`] rows above leaves them.
    Enter(usize),
    /// It leaves them at the lower border, where no row comes.
    Leave(usize),
    /// The windows around it hold all of their rows.
    Middle(usize),
}

/// The turns of rows, so that some of them are in the middle one after another.
pub(super) fn turns(rows: Range<usize>, height: usize) -> impl Iterator<Item = Turn> {
    let coming = rows.start.saturating_sub(REACH)..rows.end + REACH;
    coming.flat_map(move |coming| {
        let moved = if coming < height { Some(Turn::Enter(coming)) } else { coming.checked_sub(SIDE).map(Turn::Leave) };
        let middle = coming.checked_sub(REACH).filter(|middle| rows.contains(middle));
        [moved, middle.map(Turn::Middle)].into_iter().flatten()
    })
}

/// The differences in the rows of windows whose centres lie in one row. Each pixel has one or several: those at the disparities
/// that are tried.
pub(super) struct Variances {
    size: Size,
    /// Grey differences, `[row mod 7][tried][column]`. Rows have [`REACH`] more columns on both sides, with zeros.
    differences: Buffer<i16>,
    /// Those of the row that enters next.
    entering: Buffer<i16>,
    /// Sums of the differences in each column, and of their squares, `[tried][column]`.
    sums: Buffer<i32>,
    squares: Buffer<i32>,
    /// The variances in the windows around a row, times their pixels, `[tried][column]`.
    variances: Buffer<f32>,
}

impl Variances {
    pub(super) fn new(size: Size, tried: usize) -> Result<Self, Error> {
        let (what, all, width) = ("grey differences", tried * wide(size.width), size.width);
        Ok(Self {
            size,
            differences: Buffer::filled(what, SIDE * all, 0)?,
            entering: Buffer::filled(what, all, 0)?,
            sums: Buffer::filled(what, all, 0)?,
            squares: Buffer::filled(what, all, 0)?,
            variances: Buffer::filled(what, tried * width, 0.0)?,
        })
    }

    /// The bytes that they take for rows of this width.
    pub(super) fn bytes(width: usize, tried: usize) -> u64 {
        let of = |len: usize, bytes: usize| len as u64 * bytes as u64;
        let all = tried * wide(width);
        of((SIDE + 1) * all, 2) + of(2 * all, 4) + of(tried * width, 4)
    }

    /// The differences of a row at each tried disparity, `[tried][column]`, to be written before it enters. A multiple of [`LANES`]
    /// columns.
    #[inline(always)]
    pub(super) fn entering_mut(&mut self) -> impl Iterator<Item = &mut [i16]> {
        self.entering.chunks_exact_mut(wide(self.size.width)).map(|row| {
            let end = row.len() - REACH;
            &mut row[REACH..end]
        })
    }

    /// Adds row y, and removes the one that is [`SIDE`] rows above.
    #[inline(always)]
    pub(super) fn enter(&mut self, y: usize) {
        let all = self.entering.len();
        let row = self.differences[(y % SIDE) * all..][..all].iter_mut().zip(&*self.entering);
        for (((held, &entering), sum), square) in row.zip(&mut self.sums).zip(&mut self.squares) {
            let change = i32::from(entering - *held);
            *sum += change;
            // The difference of two squares.
            *square += change * i32::from(entering + *held);
            *held = entering;
        }
    }

    /// Removes row y.
    #[inline(always)]
    pub(super) fn leave(&mut self, y: usize) {
        self.entering.fill(0);
        self.enter(y);
    }

    /// The variances in the windows around row y, which is in the middle, times their pixels, `[tried][column]`.
    #[inline(always)]
    pub(super) fn compute(&mut self, y: usize) -> &[f32] {
        let Size { width, height } = self.size;
        let (wide, rows) = (wide(width), (height.min(y + REACH + 1) - y.saturating_sub(REACH)) as f32);
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
                    Turn::Enter(y) => {
                        inside.retain(|&row| row + SIDE != y);
                        inside.push(y);
                    }
                    Turn::Leave(y) => inside.retain(|&row| row != y),
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
