//! Joins the labels of neighbouring tiles.
//!
//! Around a border both tiles have labels. Where there is no texture they may differ, and a straight border would show. So
//! the border runs where they agree: of all ways through the rows or columns that both have, it takes the one across which
//! labels differ least. That is the lowest energy of a chain, which one pass of messages finds exactly.

use std::ops::Range;

use super::tile::{SHARED, Span, Tile};
use crate::{Error, Size, memory};

/// The most that labels count as different.
const MOST: u64 = 16;

/// What a difference of 1 weighs, against a distance of 1 from the middle. So a border stays in the middle if nothing else
/// matters.
const WEIGHT: u64 = 256;

/// The labels of a tile, and those of the image so far.
pub(super) struct Joint<'a> {
    pub(super) tile: &'a Tile,
    /// `[height][width]` of the tile.
    pub(super) labels: &'a [u16],
    /// The tiles that the image has already.
    pub(super) matched: &'a [Tile],
    pub(super) width: usize,
    /// `[height][width]` of the image.
    pub(super) image: &'a mut [u16],
}

impl Joint<'_> {
    /// Copies the tile's labels to the image, up to the borders with the tiles that are there.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub(super) fn copy(self) -> Result<(), Error> {
        let Tile { columns, rows, .. } = self.tile;
        let beside = self.matched.iter().filter(|tile| tile.rows == *rows).map(|tile| &tile.columns);
        let beyond = self.matched.iter().filter(|tile| tile.columns == *columns).map(|tile| &tile.rows);
        let of_rows = self.borders(columns, neighbours(columns, beside), &rows.kept, |x, y| (x, y))?;
        let of_columns = self.borders(rows, neighbours(rows, beyond), &columns.kept, |y, x| (x, y))?;
        self.copy_between(&of_rows, &of_columns);
        Ok(())
    }

    /// Where the tile begins and ends across the borders, for each place along them. `place` is the column and row of a place
    /// across and along.
    fn borders(
        &self,
        own: &Span,
        [before, after]: [Option<&Span>; 2],
        along: &Range<usize>,
        place: impl Fn(usize, usize) -> (usize, usize),
    ) -> Result<[Vec<usize>; 2], Error> {
        let of_tile = |across: usize, along: usize| self.of_tile(place(across, along));
        let of_image = |across: usize, along: usize| self.of_image(place(across, along));
        let Range { start, end } = own.shared();
        let begin = before.map_or(start..start, |before| start..before.shared().end);
        let until = after.map_or(end..end, |after| after.shared().start..end);
        Ok([
            Overlap { across: begin, along: along.clone(), first: of_image, second: of_tile }.border()?,
            Overlap { across: until, along: along.clone(), first: of_tile, second: of_image }.border()?,
        ])
    }

    /// Copies what lies between the borders. Beyond the rows and columns that the tile keeps, they go straight on.
    fn copy_between(self, [left, right]: &[Vec<usize>; 2], [above, below]: &[Vec<usize>; 2]) {
        let Tile { columns, rows, .. } = self.tile;
        let nearest = |kept: &Range<usize>, at: usize| at.clamp(kept.start, kept.end - 1) - kept.start;
        let [first, end] = [above.iter().max(), below.iter().min()].map(|row| row.copied().unwrap_or_default());
        for y in rows.shared() {
            let row = nearest(&rows.kept, y);
            let inside = left[row]..right[row];
            let labels = &self.labels[(y - rows.all.start) * columns.all.len()..][..columns.all.len()];
            let labels = &labels[inside.start - columns.all.start..inside.end - columns.all.start];
            let image = &mut self.image[y * self.width..][inside.clone()];
            if (first..end).contains(&y) {
                image.copy_from_slice(labels);
                continue;
            }
            for ((x, image), label) in inside.zip(image).zip(labels) {
                let column = nearest(&columns.kept, x);
                *image = if (above[column]..below[column]).contains(&y) { *label } else { *image };
            }
        }
    }

    fn of_image(&self, (x, y): (usize, usize)) -> u16 {
        self.image[y * self.width + x]
    }

    fn of_tile(&self, (x, y): (usize, usize)) -> u16 {
        let Tile { columns, rows, .. } = self.tile;
        self.labels[(y - rows.all.start) * columns.all.len() + x - columns.all.start]
    }
}

/// The neighbours on either side among the spans of a line of tiles.
fn neighbours<'a>(own: &Span, mut line: impl Iterator<Item = &'a Span> + Clone) -> [Option<&'a Span>; 2] {
    [line.clone().find(|other| other.kept.end == own.kept.start), line.find(|other| other.kept.start == own.kept.end)]
}

/// The most bytes that joining tiles of this size takes: for each place along a border, where ways through the shared columns
/// come from, and the way found; and the other borders.
pub(super) fn bytes(Size { width, height }: Size) -> u64 {
    let place = size_of::<usize>();
    (width.max(height) * 2 * SHARED + 2 * (width + height) * place) as u64
}

/// The labels of two tiles where both have some.
struct Overlap<First, Second> {
    across: Range<usize>,
    along: Range<usize>,
    /// The tile that keeps what comes before the border: the label of a place across and along.
    first: First,
    second: Second,
}

impl<First: Fn(usize, usize) -> u16, Second: Fn(usize, usize) -> u16> Overlap<First, Second> {
    /// For each place along the border, where the second tile begins.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    fn border(&self) -> Result<Vec<usize>, Error> {
        let (start, width) = (self.across.start, self.across.len());
        let mut borders = memory::filled("borders of tiles", self.along.len(), self.across.end)?;
        if width < 2 {
            return Ok(borders);
        }
        // The second tile may begin 1 to width - 1 places after the start. For each, where it began one place before.
        let mut origins = memory::filled("borders of tiles", self.along.len() * width, 0)?;
        let mut energies = vec![0; width];
        for (along, origins) in self.along.clone().zip(origins.chunks_exact_mut(width)) {
            self.pass(along, &mut energies, origins);
            for (border, energy) in energies.iter_mut().enumerate().skip(1) {
                *energy += self.jump(along, start + border) + border.abs_diff(width / 2) as u64;
            }
        }
        let mut border = (1..width).min_by_key(|&border| energies[border]).unwrap_or(1);
        for (found, origins) in borders.iter_mut().zip(origins.chunks_exact(width)).rev() {
            *found = start + border;
            border = origins[border].into();
        }
        Ok(borders)
    }

    /// The energy of a jump across the border.
    fn jump(&self, along: usize, border: usize) -> u64 {
        weigh((self.first)(border - 1, along), (self.second)(border, along))
    }

    /// Adds what it costs to come from a border one place before: the labels between the two borders are the first
    /// tile's on one side and the second's on the other. Distances add up along the border, so two passes find the least.
    fn pass(&self, along: usize, energies: &mut [u64], origins: &mut [u8]) {
        origins.iter_mut().zip(0..).for_each(|(origin, border)| *origin = border);
        if along == self.along.start {
            return;
        }
        let step = |across: usize| weigh((self.first)(across, along), (self.second)(across, along));
        let mut improve = |from: usize, to: usize| {
            let energy = energies[from] + step(self.across.start + from.min(to));
            if energy < energies[to] {
                (energies[to], origins[to]) = (energy, origins[from]);
            }
        };
        (2..self.across.len()).for_each(|border| improve(border - 1, border));
        (1..self.across.len() - 1).rev().for_each(|border| improve(border + 1, border));
    }
}

/// Where the second of two maps should begin, for each place along their border: the way through the places across that both have, along
/// which they agree best. `first` and `second` return their disparities in pixels at a place across and along; those that are not
/// finite are unknown. At least the first place of each line stays the first map's, and the last the second's.
///
/// # Errors
/// [`Error::OutOfMemory`].
pub fn border(
    across: usize,
    along: usize,
    first: impl Fn(usize, usize) -> f32,
    second: impl Fn(usize, usize) -> f32,
) -> Result<Vec<usize>, Error> {
    let first = |across: usize, along: usize| label(first(across, along));
    let second = |across: usize, along: usize| label(second(across, along));
    Overlap { across: 0..across, along: 0..along, first, second }.border()
}

/// A whole number for a disparity; 0 stands for an unknown one, far from all others.
fn label(disparity: f32) -> u16 {
    const ZERO: f32 = 32_768.0;
    if disparity.is_finite() { (ZERO + disparity.clamp(-30_000.0, 30_000.0)).round() as u16 } else { 0 }
}

fn weigh(one: u16, other: u16) -> u64 {
    WEIGHT * u64::from(one.abs_diff(other)).min(MOST)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Labels of two tiles, `[along][across]`.
    type Maps<'a> = [&'a [u16]; 2];

    fn energy(maps: Maps<'_>, across: usize, borders: &[usize]) -> u64 {
        let label = |map: usize, along: usize, i: usize| maps[map][along * across + i];
        let jumps = borders.iter().enumerate().map(|(along, &border)| {
            weigh(label(0, along, border - 1), label(1, along, border)) + border.abs_diff(across / 2) as u64
        });
        let steps = borders.windows(2).zip(1..).map(|(pair, along)| {
            let between = pair[0].min(pair[1])..pair[0].max(pair[1]);
            between.map(|i| weigh(label(0, along, i), label(1, along, i))).sum::<u64>()
        });
        jumps.chain(steps).sum()
    }

    fn border(maps: Maps<'_>, along: usize, across: usize) -> Vec<usize> {
        let [first, second] = maps.map(|map| move |i: usize, along: usize| map[along * across + i]);
        Overlap { across: 0..across, along: 0..along, first, second }.border().unwrap()
    }

    /// Against all ways.
    #[test]
    fn no_other_border_costs_less() {
        let mut random = fastrand::Rng::with_seed(5);
        for _ in 0..200 {
            let (along, across) = (random.usize(1..5), random.usize(2..6));
            let maps = [0, 1].map(|_| (0..along * across).map(|_| random.u16(..4)).collect::<Vec<_>>());
            let maps = [&maps[0][..], &maps[1]];
            let found = energy(maps, across, &border(maps, along, across));
            let ways = (across - 1).pow(along as u32);
            let way = |way: usize| -> Vec<usize> {
                (0..along).map(|place| 1 + way / (across - 1).pow(place as u32) % (across - 1)).collect()
            };
            assert_eq!((0..ways).map(|index| energy(maps, across, &way(index))).min(), Some(found));
        }
    }

    #[test]
    fn a_border_runs_where_maps_agree_else_in_the_middle() {
        let same = [7; 3 * 8];
        assert_eq!(border([&same, &same], 3, 8), [4; 3]);
        // They agree in columns 1 and 2 only.
        let first: Vec<u16> = (0..3 * 8).map(|i| if i % 8 == 1 || i % 8 == 2 { 7 } else { 20 }).collect();
        assert_eq!(border([&first, &same], 3, 8), [3; 3]);
        assert_eq!(border([&same, &same], 2, 1), [1; 2]);
    }

    fn spans(len: usize, kept: usize, halo: usize) -> Vec<Span> {
        let span = |start: usize| {
            let end = (start + kept).min(len);
            Span { all: start.saturating_sub(halo)..(end + halo).min(len), kept: start..end }
        };
        (0..len).step_by(kept).map(span).collect()
    }

    fn tiles([width, height]: [usize; 2], [columns, rows]: [usize; 2], halo: usize) -> Vec<Tile> {
        let (columns, rows) = (spans(width, columns, halo), spans(height, rows, halo));
        let tile = |columns: &Span, rows: &Span| Tile { columns: columns.clone(), rows: rows.clone(), margin: 0 };
        columns.iter().flat_map(|columns| rows.iter().map(|rows| tile(columns, rows)).collect::<Vec<_>>()).collect()
    }

    /// Joins tiles with random labels in this order. Returns the labels of each, and the image.
    fn joined(tiles: &[Tile], width: usize, height: usize, random: &mut fastrand::Rng) -> (Vec<Vec<u16>>, Vec<u16>) {
        let mut image = vec![u16::MAX; width * height];
        let labels: Vec<Vec<u16>> =
            tiles.iter().map(|tile| (0..tile.size().pixels()).map(|_| random.u16(..4)).collect()).collect();
        for (index, tile) in tiles.iter().enumerate() {
            Joint { tile, labels: &labels[index], matched: &tiles[..index], width, image: &mut image }.copy().unwrap();
        }
        (labels, image)
    }

    /// However the labels are: what the neighbour on one side may keep ends before what the other one may keep begins.
    #[test]
    fn the_borders_of_a_tile_never_cross() {
        for halo in [0, 1, 16, 96] {
            let spans = spans(300, 32, halo);
            assert!(spans.windows(3).all(|three| three[0].shared().end <= three[2].shared().start), "{halo}");
        }
    }

    #[test]
    fn every_pixel_is_written_in_any_order_of_tiles() {
        for (seed, halo) in [(1, 0), (2, 1), (3, 2), (4, 30), (5, 96)] {
            let mut random = fastrand::Rng::with_seed(seed);
            let mut tiles = tiles([170, 125], [32, 32], halo);
            random.shuffle(&mut tiles);
            let (_, image) = joined(&tiles, 170, 125, &mut random);
            assert!(!image.contains(&u16::MAX));
        }
    }

    /// Two tiles side by side, then one above the other, in both orders. Their halos reach all over the image.
    #[test]
    fn each_side_of_a_border_has_the_labels_of_its_tile() {
        let mut random = fastrand::Rng::with_seed(7);
        let across = 32..96;
        for (width, height, is_reversed) in [(128, 40, false), (128, 40, true), (40, 128, false), (40, 128, true)] {
            let mut tiles = tiles([width, height], [64, 64], 64);
            let [first, second] = if is_reversed { [1, 0] } else { [0, 1] };
            if is_reversed {
                tiles.reverse();
            }
            let (labels, image) = joined(&tiles, width, height, &mut random);
            let place = |across, along| if width == 128 { along * width + across } else { across * width + along };
            let overlap = Overlap {
                across: across.clone(),
                along: 0..40,
                first: |across, along| labels[first][place(across, along)],
                second: |across, along| labels[second][place(across, along)],
            };
            for (along, border) in overlap.border().unwrap().into_iter().enumerate() {
                for across in 0..128 {
                    let tile = if across < border { first } else { second };
                    assert_eq!(image[place(across, along)], labels[tile][place(across, along)], "{across} {along}");
                }
            }
        }
    }
}
