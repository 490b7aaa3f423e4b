//! Offsets from disparities to those at which the images match best.

use super::{IsStopped, go_on};
use crate::{DisparityMap, Error, StereoPair, image::grey, memory, metrics::check_size};

/// Disparities are tried in steps of a quarter of a pixel.
const STEPS: usize = 4;

/// The number of disparities that are tried, and the one in the middle.
const TRIED: usize = 5;
const MIDDLE: usize = TRIED / 2;

/// How far windows reach from their centres.
const REACH: usize = 3;
const ROWS: usize = 2 * REACH + 1;

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
    map: DisparityMap,
    is_stopped: IsStopped<'_>,
) -> Result<DisparityMap, Error> {
    let (width, height) = (pair.size().width, pair.size().height);
    check_size("the disparity map", map.size(), pair.size())?;
    let mut windows = Windows::new(width)?;
    let mut going = Ok(());
    let map = map.replaced(|values| {
        // A row is compared before the windows of a row above it change anything.
        for coming in 0..height + REACH {
            going = go_on(is_stopped);
            if going.is_err() {
                return;
            }
            if coming < height {
                windows.enter(pair, coming, &values[coming * width..][..width]);
            }
            if let Some(y) = coming.checked_sub(REACH) {
                windows.add_offsets(&mut values[y * width..][..width]);
                if let Some(top) = y.checked_sub(REACH) {
                    windows.leave(top);
                }
            }
        }
    });
    going.map(|()| map)
}

/// The differences in the rows of windows whose centres lie in one row.
struct Windows {
    width: usize,
    /// How many rows there are.
    rows: usize,
    /// The right image's row in steps, in 128ths of a grey value.
    right: Vec<i32>,
    /// Grey differences in eighths, `[row mod 7][step][column]`. Rows have [`REACH`] more columns on both sides, with zeros.
    differences: Vec<i16>,
    /// Sums of the differences in each column, and of their squares, `[step][column]`.
    sums: Vec<i32>,
    squares: Vec<i32>,
    /// The variances in the windows around a row, times the square of their pixels, `[step][column]`.
    variances: Vec<f32>,
}

impl Windows {
    fn new(width: usize) -> Result<Self, Error> {
        let (what, columns) = ("grey differences", TRIED * (width + 2 * REACH));
        Ok(Self {
            width,
            rows: 0,
            right: memory::filled(what, STEPS * width, 0)?,
            differences: memory::filled(what, ROWS * columns, 0)?,
            sums: memory::filled(what, columns, 0)?,
            squares: memory::filled(what, columns, 0)?,
            variances: memory::filled(what, TRIED * width, 0.0)?,
        })
    }

    fn columns(&self) -> usize {
        TRIED * (self.width + 2 * REACH)
    }

    /// Adds row y, which has these disparities.
    fn enter(&mut self, pair: &StereoPair, y: usize, disparities: &[f32]) {
        let columns = self.columns();
        interpolate(&pair.right().pixels()[y * self.width..][..self.width], &mut self.right);
        let row = &mut self.differences[(y % ROWS) * columns..][..columns];
        let left = &pair.left().pixels()[y * self.width..][..self.width];
        for (x, (&colour, &disparity)) in left.iter().zip(disparities).enumerate() {
            let (first, grey) = (first_step(x, disparity, self.width), 128 * i32::from(grey(colour)));
            for step in 0..TRIED {
                // A larger disparity lies farther left.
                let difference = first.map_or(0, |first| (grey - self.right[first + TRIED - 1 - step]) >> 4);
                row[step * (self.width + 2 * REACH) + REACH + x] = difference as i16;
            }
        }
        self.rows += 1;
        self.add(y, 1);
    }

    /// Removes row y.
    fn leave(&mut self, y: usize) {
        self.rows -= 1;
        self.add(y, -1);
    }

    fn add(&mut self, y: usize, sign: i32) {
        let columns = self.columns();
        let row = &self.differences[(y % ROWS) * columns..][..columns];
        for ((&difference, sum), square) in row.iter().zip(&mut self.sums).zip(&mut self.squares) {
            let difference = i32::from(difference);
            *sum += sign * difference;
            *square += sign * difference * difference;
        }
    }

    /// Adds the offsets to the row in the middle.
    fn add_offsets(&mut self, disparities: &mut [f32]) {
        let wide = self.width + 2 * REACH;
        for (step, variances) in self.variances.chunks_exact_mut(self.width).enumerate() {
            let [sums, squares] = [&self.sums, &self.squares].map(|all| &all[step * wide..][..wide]);
            for (x, (variance, (sums, squares))) in
                variances.iter_mut().zip(sums.windows(ROWS).zip(squares.windows(ROWS))).enumerate()
            {
                let pixels = self.rows * (self.width.min(x + REACH + 1) - x.saturating_sub(REACH));
                let [sum, square] = [sums, squares].map(|values| values.iter().copied().map(i64::from).sum::<i64>());
                *variance = (pixels as i64 * square - sum * sum) as f32;
            }
        }
        for (x, disparity) in disparities.iter_mut().enumerate() {
            if first_step(x, *disparity, self.width).is_some() {
                let steps = best_step(std::array::from_fn(|step| self.variances[step * self.width + x]));
                *disparity = (nearest_step(*disparity) as f32 + steps) / STEPS as f32;
            }
        }
    }
}

/// A disparity in steps, rounded.
fn nearest_step(disparity: f32) -> i64 {
    (STEPS as f32 * disparity).round() as i64
}

/// Where the tried disparities of a pixel in column x begin in the right image's row in steps; `None` if it lacks one.
fn first_step(x: usize, disparity: f32, width: usize) -> Option<usize> {
    let step = disparity.is_finite().then(|| nearest_step(disparity))?;
    let first = ((STEPS * x) as i64).saturating_sub(step).saturating_sub(MIDDLE as i64);
    usize::try_from(first).ok().filter(|first| first + TRIED <= STEPS * (width - 1) + 1)
}

/// The place of the least variance, in steps from the middle one.
fn best_step(variances: [f32; TRIED]) -> f32 {
    let best = (1..TRIED - 1).min_by(|&a, &b| variances[a].total_cmp(&variances[b])).unwrap_or(MIDDLE);
    let [before, least, after] = [variances[best - 1], variances[best], variances[best + 1]];
    let curvature = before - 2.0 * least + after;
    let fraction = if curvature > 0.0 { ((before - after) / (2.0 * curvature)).clamp(-1.0, 1.0) } else { 0.0 };
    best as f32 - MIDDLE as f32 + fraction
}

/// Writes the grey values of a row in steps, in 128ths. The borders are repeated outward.
fn interpolate(row: &[[u8; 3]], steps: &mut [i32]) {
    const WEIGHTS: [[i32; 4]; STEPS] = [[0, 128, 0, 0], [-9, 111, 29, -3], [-8, 72, 72, -8], [-3, 29, 111, -9]];
    let last = row.len() - 1;
    let at = |x: usize| i32::from(grey(row[x.min(last)]));
    let mut near = [at(0), at(0), at(1), at(2)];
    for (x, steps) in steps.chunks_exact_mut(STEPS).enumerate() {
        for (step, weights) in steps.iter_mut().zip(WEIGHTS) {
            *step = weights.iter().zip(near).map(|(weight, near)| weight * near).sum();
        }
        near = [near[1], near[2], near[3], at(x + 3)];
    }
}
