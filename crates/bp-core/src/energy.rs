//! The energy of a labelling, in exact integers.

use std::ops::Range;

use fearless_simd::{Level, Simd, dispatch};
use rayon::prelude::*;

use crate::{DataCost, EdgeLevels, Error, Image, Model, Size, StereoPair, image::APRON};

/// Rows that one thread adds up. Only their features are held.
const ROWS: usize = 32;

/// The most bytes that a profile compares for each pixel.
const MOST_FEATURES: usize = 4;

/// The energy of a labelling in the units of its profile.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Energy {
    /// Sum of D(p, f_p) over all pixels.
    pub data: u64,
    /// Sum of V(f_p, f_q) over all pairs of neighbours.
    pub smoothness: u64,
}

impl Energy {
    /// The energy of `labels` `[height][width]`. It uses data costs without a seed and all edges of the image, even those
    /// across a cut, so that the energies of all plans are comparable.
    ///
    /// # Errors
    /// [`Error::PixelCount`] if `labels` does not hold one label per pixel, [`Error::OutOfMemory`].
    pub fn of(pair: &StereoPair, model: &Model, labels: &[u16]) -> Result<Self, Error> {
        let size = pair.size();
        if labels.len() != size.pixels() {
            return Err(Error::PixelCount { size, found: labels.len() });
        }
        let parts = (0..size.height).into_par_iter().step_by(ROWS);
        parts
            .map(|first| Self::of_rows(pair, model, labels, first..size.height.min(first + ROWS)))
            .try_reduce(Self::default, |a, b| {
                Ok(Self { data: a.data + b.data, smoothness: a.smoothness + b.smoothness })
            })
    }

    /// The temporary bytes of [`Energy::of`] for images of this size on this many threads: colours and features of some rows of
    /// both images.
    #[must_use]
    pub fn temporary_bytes(size: Size, threads: usize) -> u64 {
        let (rows, known) = (size.height.min(ROWS), size.height.min(ROWS + 2 * APRON));
        let a_column = 2 * (Image::COLOUR_BYTES as usize * known + MOST_FEATURES * rows);
        size.height.div_ceil(ROWS).min(threads) as u64 * (a_column * size.width) as u64
    }

    /// The data costs of some rows, and the smoothness costs of the edges within them and to the row below.
    fn of_rows(pair: &StereoPair, model: &Model, labels: &[u16], rows: Range<usize>) -> Result<Self, Error> {
        let size = pair.size();
        let cost = DataCost::of_pair(&pair.strip(rows.clone()), *model)?;
        let (edges, level) = (model.edges(), Level::new());
        let labels_of = |y: usize| &labels[y * size.width..][..size.width];
        let greys_of = |y: usize| &pair.left().greys()[y * size.width..][..size.width];
        let mut energy = Self::default();
        for (row, y) in rows.enumerate() {
            let labels = labels_of(y);
            energy.data += cost.of_row(row, labels);
            let greys = greys_of(y);
            energy.smoothness += smoothness(level, edges, [labels, &labels[1..]], [greys, &greys[1..]]);
            if y + 1 < size.height {
                energy.smoothness += smoothness(level, edges, [labels, labels_of(y + 1)], [greys, greys_of(y + 1)]);
            }
        }
        Ok(energy)
    }

    /// The sum of data and smoothness.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.data + self.smoothness
    }
}

/// The smoothness costs of the edges between nodes and as many neighbours.
fn smoothness(level: Level, edges: &EdgeLevels, labels: [&[u16]; 2], greys: [&[u8]; 2]) -> u64 {
    dispatch!(level, simd => smoothness_by(simd, edges, labels, greys))
}

/// Compares the costs of an edge's level and of all levels before it. The least of them is that of its own level, because
/// costs never rise from level to level.
#[inline(always)]
fn smoothness_by<S: Simd>(simd: S, edges: &EdgeLevels, labels: [&[u16]; 2], greys: [&[u8]; 2]) -> u64 {
    let levels = edges.smoothness().map(|level| [level.slope, level.truncation].map(u32::from));
    simd.vectorize(
        #[inline(always)]
        || {
            let mut sum = 0;
            for ((a, b), (grey_a, grey_b)) in labels[0].iter().zip(labels[1]).zip(greys[0].iter().zip(greys[1])) {
                let (distance, difference) = (u32::from(a.abs_diff(*b)), grey_a.abs_diff(*grey_b));
                let mut least = u32::MAX;
                for (i, [slope, truncation]) in levels.into_iter().enumerate() {
                    let reached = i == 0 || difference > edges.most()[i - 1];
                    let cost = (slope * distance).min(truncation);
                    least = if reached { cost.min(least) } else { least };
                }
                sum += least;
            }
            u64::from(sum)
        },
    )
}

/// The label with the lowest data cost of every pixel, `[height][width]`: matching without smoothness. The smallest
/// label wins a tie.
///
/// # Errors
/// [`Error::OutOfMemory`].
pub fn cheapest_labels(pair: &StereoPair, model: &Model) -> Result<Vec<u16>, Error> {
    let size = pair.size();
    let cost = DataCost::of_pair(pair, *model)?;
    let cheapest = |i| {
        let labels = 0..model.labels() as u16;
        labels.min_by_key(|&label| cost.at(i % size.width, i / size.width, label)).unwrap_or(0)
    };
    Ok((0..size.pixels()).map(cheapest).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Profile;

    #[test]
    fn energy_counts_every_pixel_and_edge_once() {
        let grey = |values: &[u8]| Image::from_grey(2, 2, values).unwrap();
        let pair = StereoPair::new(grey(&[0, 10, 20, 30]), grey(&[0, 20, 20, 30])).unwrap();
        let model = Model::new(Profile::Mrf, 3).unwrap();
        let energy = Energy::of(&pair, &model, &[0, 0, 0, 0]).unwrap();
        assert_eq!(energy, Energy { data: 30, smoothness: 0 });
        let energy = Energy::of(&pair, &model, &[1, 1, 0, 2]).unwrap();
        assert_eq!(energy, Energy { data: 765 + 30 + 765, smoothness: 20 + 20 + 40 });
        // Horizontal neighbours differ by 10 grey values, vertical ones by 20.
        let energy = Energy::of(&pair, &model.with_edges_halved_above(10), &[1, 1, 0, 2]).unwrap();
        assert_eq!(energy.smoothness, 10 + 10 + 40);
        assert!(Energy::of(&pair, &model, &[0; 3]).is_err());
    }

    #[test]
    #[cfg_attr(miri, ignore = "takes minutes")]
    fn rows_that_are_added_up_apart_give_the_sum_of_single_pixels() {
        let noise = |i: usize| [7919, 104_729, 31].map(|factor| (i * i * factor / 7 % 251) as u8);
        for (width, height) in [(1, 1), (1, 70), (7, 2 * ROWS), (5, 2 * ROWS + 1), (150, 3)] {
            let view = |from: usize| Image::from_rgb(width, height, (from..from + width * height).map(noise).collect());
            let pair = StereoPair::new(view(0).unwrap(), view(100).unwrap()).unwrap();
            let model = Model::new(Profile::Census16, 5).unwrap();
            let labels: Vec<u16> = (0..width * height).map(|i| (i * i % 5) as u16).collect();
            let cost = DataCost::of_pair(&pair, model).unwrap();
            let mut expected = Energy::default();
            for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
                let label = |x: usize, y: usize| labels[y * width + x];
                expected.data += u64::from(cost.at(x, y, label(x, y)));
                for (x1, y1) in [(x + 1, y), (x, y + 1)].into_iter().filter(|&(x, y)| x < width && y < height) {
                    let edge = model.smoothness_between(pair.left().grey(x, y), pair.left().grey(x1, y1));
                    expected.smoothness += u64::from(edge.of(label(x, y), label(x1, y1)));
                }
            }
            assert_eq!(Energy::of(&pair, &model, &labels).unwrap(), expected, "{width}x{height}");
        }
    }

    #[test]
    fn the_cheapest_label_is_the_smallest_on_ties() {
        let grey = |values: &[u8]| Image::from_grey(3, 1, values).unwrap();
        let pair = StereoPair::new(grey(&[7, 7, 9]), grey(&[9, 7, 7])).unwrap();
        assert_eq!(cheapest_labels(&pair, &Model::new(Profile::Mrf, 3).unwrap()).unwrap(), [0, 0, 2]);
    }
}
