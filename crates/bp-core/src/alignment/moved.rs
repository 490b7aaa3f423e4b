//! Measures by how many rows points move between the images.

use fearless_simd::{Level, Simd, dispatch};
use rayon::prelude::*;

use super::weights;
use crate::{Image, Size, StereoPair, survey::points::Point};

/// Columns and rows of a window.
const WIDTH: usize = 16;
const HEIGHT: usize = 13;

/// The first and last row of a window are moved by up to this many pixels.
const SLANT: usize = 3;
const STEEPEST: f32 = SLANT as f32 / MIDDLE[1] as f32;

/// The columns that a window and its interpolation may read.
const WIDE: usize = WIDTH + 3 + 2 * SLANT;

/// The same, rounded up to whole vectors.
const LINE: usize = WIDE.next_multiple_of(16);

/// The least mean of the squared slopes along columns.
const LEAST_CONTRAST: f32 = 1.0;

/// The most by which an unknown position along the row may raise the variance of the position along the column.
const MOST_MIXED: f32 = 20.0;

/// The window is that of the pixel at this column and row of it.
const MIDDLE: [usize; 2] = [WIDTH / 2, HEIGHT / 2];

/// Points that one thread measures together.
const TOGETHER: usize = 32;

/// The most steps towards the best match, and the smallest in pixels.
const STEPS: usize = 6;
const LEAST_STEP: f32 = 0.03;

/// A match farther than this from its start is another one.
const FARTHEST: f32 = 1.5;

/// [`FARTHEST`] in whole pixels.
const FAR: usize = FARTHEST.ceil() as usize;

/// The columns and rows that are interpolated for windows this far away.
const AREA: [usize; 2] = [LINE + 2 * FAR, HEIGHT + 3 + 2 * FAR];

/// A window matches if the sum of its squared differences is at most this share of the sum of its squared contrasts.
const LARGEST_SHARE: f32 = 0.25;

/// A point in the right image, and by how many rows it moved, in pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moved {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) rows: f64,
    /// The inverse of the variance of `rows`.
    pub(super) weight: f64,
}

/// Values of a window, `[row][column]`.
type Window = [[f32; WIDTH]; HEIGHT];

/// Measures the points whose windows have texture and match.
pub(super) fn measure(pair: &StereoPair, points: &[Point]) -> Vec<Moved> {
    let level = Level::new();
    let of_chunk = |points: &[Point]| dispatch!(level, simd => measured(simd, pair, points));
    points.par_chunks(TOGETHER).flat_map_iter(of_chunk).collect()
}

#[inline(always)]
fn measured<S: Simd>(simd: S, pair: &StereoPair, points: &[Point]) -> Vec<Moved> {
    simd.vectorize(
        #[inline(always)]
        || {
            let mut all = Vec::with_capacity(points.len());
            for point in points {
                all.extend(moved(pair, point));
            }
            all
        },
    )
}

/// Follows the slopes of the grey values to the best match (Lucas and Kanade 1981).
#[inline(always)]
fn moved(pair: &StereoPair, point: &Point) -> Option<Moved> {
    let patch = Patch::of(pair.left(), point.x, point.y)?;
    let start = Match { x: point.column as f32, slant: 0.0, y: point.row as f32 };
    let area = Area::of(pair.right(), point);
    let mut found = start;
    let mut squares = f32::INFINITY;
    let mut window = [[0.0; WIDTH]; HEIGHT];
    for _ in 0..STEPS {
        area.read(found, &mut window)?;
        let step;
        (squares, step) = patch.compare(&mut window);
        let [across, slant, down] = step;
        found = Match { x: found.x + across, slant: found.slant + slant, y: found.y + down };
        if (found.x - start.x).abs().max((found.y - start.y).abs()) > FARTHEST || found.slant.abs() > STEEPEST {
            return None;
        }
        if across.abs().max(down.abs()) < LEAST_STEP {
            break;
        }
    }
    // The noise of the images makes this variance; a hundredth more allows for everything else.
    let variance = squares / (WIDTH * HEIGHT) as f32 * patch.inverse[2][2] + 0.01;
    let moved = Moved {
        x: f64::from(found.x),
        y: point.y as f64,
        rows: f64::from(found.y) - point.y as f64,
        weight: f64::from(1.0 / variance),
    };
    (squares <= LARGEST_SHARE * patch.squares).then_some(moved)
}

/// Where a window matches in the right image. Each row of it lies `slant` pixels farther right than the one above, because the
/// disparity of a slanted surface changes from row to row.
#[derive(Clone, Copy)]
struct Match {
    x: f32,
    slant: f32,
    y: f32,
}

/// A window of the left image.
struct Patch {
    /// Grey values less their mean.
    greys: Window,
    /// By how much they change with x, slant and y, less the means.
    slopes: [Window; 3],
    /// The inverse of the matrix of the sums of products of slopes.
    inverse: [[f32; 3]; 3],
    /// The sum of the squares of the grey values.
    squares: f32,
}

impl Patch {
    #[inline(always)]
    fn of(left: &Image, x: usize, y: usize) -> Option<Self> {
        let wide = greys(left, x, y)?;
        let mut slopes = [[[0.0; WIDTH]; HEIGHT]; 3];
        let mut greys = [[0.0; WIDTH]; HEIGHT];
        for j in 0..HEIGHT {
            for i in 0..WIDTH {
                let at = SLANT + i + 1;
                greys[j][i] = wide[j + 1][at];
                slopes[0][j][i] = (wide[j + 1][at + 1] - wide[j + 1][at - 1]) / 2.0;
                slopes[1][j][i] = slopes[0][j][i] * (j as f32 - MIDDLE[1] as f32);
                slopes[2][j][i] = (wide[j + 2][at] - wide[j][at]) / 2.0;
            }
        }
        centre(&mut greys);
        for slopes in &mut slopes {
            centre(slopes);
        }
        let mut matrix = [[0.0; 3]; 3];
        for (row, a) in matrix.iter_mut().zip(&slopes) {
            for (sum, b) in row.iter_mut().zip(&slopes) {
                *sum = dot(a, b);
            }
        }
        let inverse = inverse(matrix)?;
        let is_determined =
            matrix[2][2] > LEAST_CONTRAST * (WIDTH * HEIGHT) as f32 && inverse[2][2] * matrix[2][2] < MOST_MIXED;
        is_determined.then(|| Self { squares: dot(&greys, &greys), greys, slopes, inverse })
    }

    /// Compares the grey values with those of another window, whose mean and contrast are made equal: the sum of the squared
    /// differences, and the step to the match in x, slant and y, if the grey values were planes.
    #[inline(always)]
    fn compare(&self, other: &mut Window) -> (f32, [f32; 3]) {
        centre(other);
        let gain = (self.squares / dot(other, other).max(f32::MIN_POSITIVE)).sqrt();
        // All four sums of products at once.
        let mut sums = [[0.0; WIDTH]; 4];
        for (j, other) in other.iter().enumerate() {
            for i in 0..WIDTH {
                let difference = self.greys[j][i] - gain * other[i];
                sums[0][i] += difference * difference;
                sums[1][i] += self.slopes[0][j][i] * difference;
                sums[2][i] += self.slopes[1][j][i] * difference;
                sums[3][i] += self.slopes[2][j][i] * difference;
            }
        }
        let [squares, a, b, c] = sums.map(
            #[inline(always)]
            |sums| sums.iter().sum::<f32>(),
        );
        let step = self.inverse.map(
            #[inline(always)]
            |[x, y, z]| x * a + y * b + z * c,
        );
        (squares, step)
    }
}

/// The inverse of a symmetric matrix; `None` if there is none.
#[inline(always)]
fn inverse([[a, b, c], [_, d, e], [_, _, f]]: [[f32; 3]; 3]) -> Option<[[f32; 3]; 3]> {
    let adjugate = [
        [d * f - e * e, c * e - b * f, b * e - c * d],
        [c * e - b * f, a * f - c * c, b * c - a * e],
        [b * e - c * d, b * c - a * e, a * d - b * b],
    ];
    let determinant = a * adjugate[0][0] + b * adjugate[0][1] + c * adjugate[0][2];
    let exists = determinant > 1e-6 * a * d * f;
    exists.then(|| {
        adjugate.map(
            #[inline(always)]
            |row| {
                row.map(
                    #[inline(always)]
                    |value| value / determinant,
                )
            },
        )
    })
}

/// The sum of products. The order of the additions does not depend on the vectors of the CPU.
#[inline(always)]
fn dot(a: &Window, b: &Window) -> f32 {
    let mut sums = [0.0; WIDTH];
    for (a, b) in a.iter().zip(b) {
        for i in 0..WIDTH {
            sums[i] += a[i] * b[i];
        }
    }
    sums.iter().sum()
}

/// Subtracts the mean.
#[inline(always)]
fn centre(window: &mut Window) {
    let mut sums = [0.0; WIDTH];
    for row in &*window {
        for i in 0..WIDTH {
            sums[i] += row[i];
        }
    }
    let mean = sums.iter().sum::<f32>() / (WIDTH * HEIGHT) as f32;
    for value in window.as_flattened_mut() {
        *value -= mean;
    }
}

/// The grey values of the right image around a point.
struct Area {
    size: Size,
    /// The column and row of the first value.
    first: [usize; 2],
    values: [[f32; AREA[0]]; AREA[1]],
}

impl Area {
    #[inline(always)]
    fn of(image: &Image, point: &Point) -> Self {
        let [left, top] = [point.column, point.row];
        let first = [left.saturating_sub(BEFORE[0] + FAR), top.saturating_sub(BEFORE[1] + FAR)];
        let size = image.size();
        let mut values = [[0.0; AREA[0]]; AREA[1]];
        for (y, values) in (first[1]..size.height).zip(&mut values) {
            read(values, &image.greys()[y * size.width..][first[0].min(size.width)..size.width]);
        }
        Self { size, first, values }
    }

    /// Reads the grey values where a window matches, by cubic interpolation (Keys 1981); `None` if it leaves the image.
    #[inline(always)]
    fn read(&self, Match { x, slant, y }: Match, window: &mut Window) -> Option<()> {
        let [left, top] = before(x.floor() as usize, y.floor() as usize, self.size)?;
        let [left, top] = [left.checked_sub(self.first[0])?, top.checked_sub(self.first[1])?];
        let greys = self.values.get(top..top + HEIGHT + 3)?;
        let down = weights(y - y.floor());
        // All lines first: loading at another place what was just stored has to wait for it.
        let mut lines = [[0.0; LINE]; HEIGHT];
        for (j, line) in lines.iter_mut().enumerate() {
            let near = [0, 1, 2, 3].map(
                #[inline(always)]
                |i: usize| greys[j + i].get(left..left + LINE),
            );
            let [Some(a), Some(b), Some(c), Some(d)] = near else { return None };
            for i in 0..LINE {
                line[i] = down[0] * a[i] + down[1] * b[i] + down[2] * c[i] + down[3] * d[i];
            }
        }
        for (j, (row, line)) in window.iter_mut().zip(&lines).enumerate() {
            let shift = SLANT as f32 + x - x.floor() + slant * (j as f32 - MIDDLE[1] as f32);
            let across = weights(shift - shift.floor());
            let line = line.get(shift as usize..shift as usize + WIDTH + 3)?;
            for i in 0..WIDTH {
                row[i] =
                    across[0] * line[i] + across[1] * line[i + 1] + across[2] * line[i + 2] + across[3] * line[i + 3];
            }
        }
        Some(())
    }
}

/// The columns and rows before that of a window that it and its interpolation may read.
const BEFORE: [usize; 2] = [MIDDLE[0] + 1 + SLANT, MIDDLE[1] + 1];

/// The first column and row that a window at this column and row may read; `None` if it may leave the image.
#[inline(always)]
fn before(x: usize, y: usize, size: Size) -> Option<[usize; 2]> {
    let (left, top) = (x.checked_sub(BEFORE[0])?, y.checked_sub(BEFORE[1])?);
    (left + WIDE <= size.width && top + HEIGHT + 3 <= size.height).then_some([left, top])
}

/// The grey values of a window and of the pixels around it that interpolation needs; `None` if they leave the image.
#[inline(always)]
fn greys(image: &Image, x: usize, y: usize) -> Option<[[f32; WIDE]; HEIGHT + 3]> {
    let mut greys = [[0.0; WIDE]; HEIGHT + 3];
    let [left, top] = before(x, y, image.size())?;
    for (row, greys) in (top..).zip(&mut greys) {
        read(greys, &image.greys()[row * image.size().width + left..][..WIDE]);
    }
    Some(greys)
}

/// Writes some grey values, as many as there is room for.
#[inline(always)]
fn read(values: &mut [f32], greys: &[u8]) {
    values.iter_mut().zip(greys).for_each(|(value, &grey)| *value = f32::from(grey));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::survey::Survey;

    /// The bytes of a match would otherwise depend on the machine.
    #[test]
    #[cfg_attr(miri, ignore = "takes minutes")]
    fn all_vector_lengths_give_the_same_numbers() {
        let wave = |x: usize, y: usize| ((x * x * 5 + y * y * 3 + 17 * x * y) as f32 / 90.0).sin();
        let view = |shift: usize, gain: f32| -> Image {
            let pixels: Vec<u8> =
                (0..200 * 90).map(|i| (128.0 + gain * wave(i % 200 + shift, i / 200)) as u8).collect();
            Image::from_grey(200, 90, pixels).unwrap()
        };
        let pair = StereoPair::new(view(0, 90.0), view(5, 70.0)).unwrap();
        let points = Survey::of(&pair).unwrap().points;
        let all = |level: Level| dispatch!(level, simd => measured(simd, &pair, &points));
        let bits =
            |level: Level| all(level).iter().map(|moved| [moved.rows.to_bits(), moved.weight.to_bits()]).collect();
        let (longest, shortest): (Vec<_>, Vec<_>) = (bits(Level::new()), bits(Level::baseline()));
        assert!(longest.len() > 20 && longest == shortest, "{} points", longest.len());
    }
}
