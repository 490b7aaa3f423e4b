//! The uniqueness check, which needs no map of the right image.

use std::ops::Range;

use fearless_simd::{Level, Simd, dispatch};
use rayon::prelude::*;

use super::{
    claims::{Claims, write_matches},
    rows::rows_together,
    speckles::remove_speckles,
    variances::{LANES, Turn, Variances, turns},
};
use crate::{DisparityMap, Error, IsStopped, Size, StereoPair, memory::Buffer, metrics::check_size, stop::go_on};

/// Surfaces that cover less than `1 / SPECK` of the image are removed.
const SPECK: usize = 3400;

/// Makes pixels unknown whose match in the right image fits another pixel better: a point of the right image is one
/// point of the left one (Marr and Poggio 1976). Of several pixels that match the same column `floor(x - d + 1/2)`, one is the
/// best. It is the nearest, because that hides the others, unless the variance of grey differences in its 7x7 window is more
/// than twice that of a farther one. Pixels stay known whose disparity differs by no more than [`AGREE`](super::AGREE) from
/// that of the best one. Pixels whose match lies outside the image become unknown too, and then surfaces of less than one part
/// in 3400 of the image.
///
/// # Errors
/// [`Error::WrongSize`] if the map has another size than the pair, [`Error::OutOfMemory`], [`Error::Stopped`].
pub fn check_unique(pair: &StereoPair, map: DisparityMap, is_stopped: IsStopped<'_>) -> Result<DisparityMap, Error> {
    check_size("the disparity map", map.size(), pair.size())?;
    let Size { width, height } = map.size();
    let mut kept = Buffer::filled_unless(is_stopped, "a checked map", map.size().pixels(), DisparityMap::UNKNOWN)?;
    let rows = rows_together(height, rayon::current_num_threads());
    kept.par_chunks_mut(rows * width).enumerate().try_for_each(|(index, kept)| {
        let first = rows * index;
        let part = Part { pair, map: map.values(), rows: first..first + kept.len() / width };
        part.keep(kept, is_stopped)
    })?;
    let size = map.size();
    // Makes room for the surfaces.
    drop(map);
    remove_specks(DisparityMap::of(size, kept))
}

/// Makes the surfaces unknown that are too small to be left by [`check_unique`].
///
/// # Errors
/// [`Error::OutOfMemory`].
pub(super) fn remove_specks(map: DisparityMap) -> Result<DisparityMap, Error> {
    let least = map.size().pixels() / SPECK;
    remove_speckles(map, least)
}

/// Some rows of a map.
struct Part<'a> {
    pair: &'a StereoPair,
    map: &'a [f32],
    rows: Range<usize>,
}

impl Part<'_> {
    /// Copies the pixels that stay known.
    fn keep(&self, kept: &mut [f32], is_stopped: IsStopped<'_>) -> Result<(), Error> {
        let (Size { width, height }, level) = (self.pair.size(), Level::new());
        let (mut windows, mut claims) = (Windows::new(self.pair.size())?, Claims::new(width)?);
        let row_of = |y: usize| &self.map[y * width..][..width];
        for turn in turns(self.rows.clone(), height) {
            go_on(is_stopped)?;
            match turn {
                Turn::Enter(y) => dispatch!(level, simd => windows.enter(simd, self.pair, y, row_of(y))),
                Turn::Middle(y) => {
                    let kept = &mut kept[(y - self.rows.start) * width..][..width];
                    kept.copy_from_slice(row_of(y));
                    dispatch!(level, simd => claims.drop_hidden(simd, windows.variances(simd, y), kept));
                }
                Turn::Leave(y) => dispatch!(level, simd => windows.leave(simd, y)),
            }
        }
        Ok(())
    }
}

/// The rows of windows in which pixels are compared with their matches.
struct Windows {
    width: usize,
    /// See [`write_matches`].
    matches: Buffer<i32>,
    variances: Variances,
}

impl Windows {
    fn new(size: Size) -> Result<Self, Error> {
        let matches = Buffer::filled("matching columns", size.width.next_multiple_of(LANES), 0)?;
        Ok(Self { width: size.width, matches, variances: Variances::new(size, 1)? })
    }

    /// Adds row y, which has these disparities.
    #[inline(always)]
    fn enter<S: Simd>(&mut self, simd: S, pair: &StereoPair, y: usize, disparities: &[f32]) {
        simd.vectorize(
            #[inline(always)]
            || {
                write_matches(simd, disparities, &mut self.matches);
                let [left, right] =
                    [pair.left(), pair.right()].map(|image| &image.greys()[y * self.width..][..self.width]);
                for row in self.variances.entering_mut() {
                    for ((difference, &left), &column) in row.iter_mut().zip(left).zip(&*self.matches) {
                        let right = right.get(column as usize).map_or(left, |&right| right);
                        *difference = i16::from(left) - i16::from(right);
                    }
                }
                self.variances.enter(y);
            },
        );
    }

    /// Removes row y.
    #[inline(always)]
    fn leave<S: Simd>(&mut self, simd: S, y: usize) {
        simd.vectorize(
            #[inline(always)]
            || self.variances.leave(y),
        );
    }

    /// The variances around row y, which is in the middle.
    #[inline(always)]
    fn variances<S: Simd>(&mut self, simd: S, y: usize) -> &[f32] {
        simd.vectorize(
            #[inline(always)]
            || self.variances.compute(y),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Image,
        finish::{AGREE, claims::LIKELIER, subpixel, variances::REACH},
        never,
    };

    /// A near square before a far wall, with noise of its own in each image, and what only the left image shows.
    fn scene(size: Size) -> (StereoPair, impl Fn(usize, usize) -> f32) {
        let near = move |x: usize, y: usize| (30..50).contains(&x) && (8..size.height - 6).contains(&y);
        let grey = |x: usize, y: usize| (x * x * 31 + y * y * 17 + x * y * 7) as u8;
        let mut right: Vec<u8> = size.nodes().map(|node| grey(node.x + 3, node.y)).collect();
        let mut left: Vec<u8> = size.nodes().map(|node| grey(node.x, node.y)).collect();
        for node in size.nodes().filter(|node| near(node.x, node.y)) {
            let own = grey(node.x * 3 + 70, node.y + 90);
            left[size.index(node)] = own;
            right[node.y * size.width + node.x - 12] = own;
        }
        let view = |greys: Vec<u8>| Image::from_grey(size.width, size.height, greys).unwrap();
        (StereoPair::new(view(left), view(right)).unwrap(), move |x, y| if near(x, y) { 12.0 } else { 3.0 })
    }

    /// Pixel by pixel.
    fn expected(pair: &StereoPair, map: &[f32]) -> Vec<f32> {
        let Size { width, height } = pair.size();
        let column = |x: usize, y: usize| {
            let column = (x as f32 - map[y * width + x] + 0.5).floor();
            (column >= 0.0 && column < width as f32).then_some(column as usize)
        };
        let difference = |x: usize, y: usize| {
            let [left, right] = [pair.left(), pair.right()].map(|image| &image.greys()[y * width..][..width]);
            column(x, y).map_or(0, |column| i32::from(left[x]) - i32::from(right[column]))
        };
        let variance = |x: usize, y: usize| {
            let near = |at: usize, end: usize| at.saturating_sub(REACH)..end.min(at + REACH + 1);
            let all = near(y, height).flat_map(|y| near(x, width).map(move |x| difference(x, y)));
            let (count, sum, squares) =
                all.fold((0, 0, 0), |(count, sum, squares), d| (count + 1, sum + d, squares + d * d));
            // Exact, but in units that depend on the number of pixels.
            f64::from(squares) - f64::from(sum * sum) / f64::from(count)
        };
        let is_kept = |x: usize, y: usize| {
            let own = column(x, y)?;
            let rivals = (0..width).filter(|&x| column(x, y) == Some(own));
            let best = rivals.reduce(|farther, nearer| {
                let is_hidden = variance(nearer, y) <= f64::from(LIKELIER) * variance(farther, y);
                if is_hidden { nearer } else { farther }
            })?;
            (map[y * width + best] - map[y * width + x]).abs().le(&AGREE).then_some(())
        };
        let value = |i: usize| is_kept(i % width, i / width).map_or(DisparityMap::UNKNOWN, |()| map[i]);
        (0..map.len()).map(value).collect()
    }

    #[test]
    #[cfg_attr(miri, ignore = "takes minutes")]
    fn vectors_keep_what_single_pixels_do() {
        for (width, height) in [(1, 1), (5, 3), (61, 19), (90, 2), (64, 120)] {
            let size = Size { width, height };
            let images = [7, 5].map(|factor| {
                let grey = |i: usize| (i * i * factor + i) as u8;
                Image::from_grey(width, height, (0..size.pixels()).map(grey).collect::<Vec<_>>()).unwrap()
            });
            let pair = StereoPair::new(images[0].clone(), images[1].clone()).unwrap();
            let value = |i: usize| match i * 37 % 23 {
                0 => DisparityMap::UNKNOWN,
                1 => -3.0,
                2 => 1000.0,
                other => (other % 5) as f32 + (i / 9 % 3) as f32 * 4.25,
            };
            let map = DisparityMap::new(size, (0..size.pixels()).map(value).collect()).unwrap();
            let expected = DisparityMap::of(size, expected(&pair, map.values()).into());
            let expected = remove_specks(expected).unwrap();
            assert_eq!(check_unique(&pair, map, &never).unwrap(), expected, "{size}");
        }
    }

    #[test]
    fn hidden_pixels_with_any_disparity_are_dropped() {
        let size = Size { width: 90, height: 40 };
        let (pair, truth) = scene(size);
        // The wall that the square hides from the right camera, left of the square.
        let hidden = |x: usize, y: usize| truth(x, y) < 4.0 && truth((x + 9).min(size.width - 1), y) > 4.0;
        for wrong in [3.0, 12.0, 25.0] {
            let value = |i: usize| {
                let (x, y) = (i % size.width, i / size.width);
                if hidden(x, y) { wrong } else { truth(x, y) }
            };
            let map = DisparityMap::new(size, (0..size.pixels()).map(value).collect()).unwrap();
            let in_fractions = subpixel(&pair, map.clone(), true, &never).unwrap();
            for (kept, what) in [(check_unique(&pair, map, &never).unwrap(), "whole"), (in_fractions, "fractions")] {
                let at = |x: usize, y: usize| (hidden(x, y), kept.at(x, y).is_some());
                let all = size.nodes().filter(|node| node.x >= 3).map(|node| at(node.x, node.y));
                let (mut left, mut lost) = (0, 0);
                for (is_hidden, is_kept) in all {
                    left += usize::from(is_hidden && is_kept);
                    lost += usize::from(!is_hidden && !is_kept);
                }
                // Windows of variances reach over borders of surfaces: one pixel of each of the square's 26 rows may be lost there.
                let lost_at = format!("{left} of 234 hidden ones are kept, {lost} others lost, at {wrong}, {what}");
                assert!(left <= 26 && lost <= 26, "{lost_at}");
            }
        }
    }

    #[test]
    fn matches_outside_the_image_and_maps_of_other_sizes_are_refused() {
        let size = Size { width: 4, height: 1 };
        let image = || Image::from_grey(4, 1, [10, 90, 40, 200]).unwrap();
        let pair = StereoPair::new(image(), image()).unwrap();
        let map = DisparityMap::new(size, vec![1.0, 0.0, -2.0, 0.0]).unwrap();
        let none = DisparityMap::UNKNOWN;
        assert_eq!(check_unique(&pair, map, &never).unwrap().values(), [none, 0.0, none, 0.0]);
        let other = DisparityMap::new(Size { width: 2, height: 1 }, vec![0.0; 2]).unwrap();
        assert!(check_unique(&pair, other, &never).is_err());
    }
}
