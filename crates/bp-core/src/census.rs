//! The census transform (Zabih and Woodfill 1994) and the match that it finds for the image's centre.

use std::{array, ops::Range};

use fearless_simd::{Level, Simd, dispatch};

use crate::{Image, Model, Node, Plan, StereoPair};

/// Half the length of the strip that is compared around the centre: the "length scan" of the thesis.
const HALF_LENGTH: usize = 10;

/// A known match, from which census-transform BP starts: the image is cut at (x, y), and `label` is the label that the
/// census transform found for that pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seed {
    /// Column of the cut.
    pub x: usize,
    /// Row of the cut.
    pub y: usize,
    /// Label of the match.
    pub label: u16,
}

impl Seed {
    /// Whether (x, y) is one of the nodes around the point where the cuts cross. There are four at most.
    #[must_use]
    pub fn touches(&self, x: usize, y: usize) -> bool {
        (x == self.x || x + 1 == self.x) && (y == self.y || y + 1 == self.y)
    }
}

/// The census code of the pixel at (x, y): its eight neighbours in row order, from the highest bit to the lowest, 1
/// where the neighbour's grey value is greater. Border pixels are repeated outward; see [`Image::grey_near`].
///
/// # Panics
/// If (x, y) lies outside the image.
#[must_use]
pub fn code(image: &Image, x: usize, y: usize) -> u8 {
    compare((x, y), &INNER, |x, y| image.grey_near(x, y))
}

/// The columns and rows of the neighbours that a code compares, relative to the pixel, from the highest bit to the lowest.
pub type Neighbours = [(isize, isize); 8];

/// The neighbours of [`code`].
pub const INNER: Neighbours = [(-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1)];

/// The neighbours of [`outer_code`].
pub const OUTER: Neighbours = [(0, -4), (0, -2), (-4, 0), (-2, 0), (2, 0), (4, 0), (0, 2), (0, 4)];

/// The furthest column or row that a code compares.
const REACH: usize = 4;

/// Columns whose codes are computed together, and those with their neighbours.
const COLUMNS: usize = 64;
const AROUND: usize = COLUMNS + 2 * REACH;

/// Writes the codes of the pixels at `columns` and `rows`, `[rows][columns][table]`.
pub(crate) fn write_codes<const TABLES: usize>(
    image: &Image,
    tables: [&Neighbours; TABLES],
    columns: Range<usize>,
    rows: Range<usize>,
    codes: &mut [[u8; TABLES]],
) {
    dispatch!(Level::new(), simd => simd.vectorize(
        #[inline(always)]
        || write_codes_in_runs(image, tables, columns, rows, codes),
    ));
}

/// Reads each grey value once, in runs of columns from top to bottom.
#[inline(always)]
fn write_codes_in_runs<const TABLES: usize>(
    image: &Image,
    tables: [&Neighbours; TABLES],
    columns: Range<usize>,
    rows: Range<usize>,
    codes: &mut [[u8; TABLES]],
) {
    let width = columns.len();
    for (x, first) in columns.zip(0..).step_by(COLUMNS) {
        let greys = |y: isize| greys_around(image.greys_near(y), x);
        // The rows around row y lie at (y + dy) mod 16.
        let mut around = [[0; AROUND]; 16];
        let place = |y: isize| (y & 15) as usize;
        let reach = REACH as isize;
        let top = rows.start as isize;
        (top - reach..top + reach).for_each(|y| around[place(y)] = greys(y));
        for (y, codes) in (top..).zip(codes.chunks_exact_mut(width)) {
            around[place(y + reach)] = greys(y + reach);
            let codes = &mut codes[first..width.min(first + COLUMNS)];
            for (table, neighbours) in tables.into_iter().enumerate() {
                let mut of_table = [0; COLUMNS];
                for &(dx, dy) in neighbours {
                    let from = REACH.wrapping_add_signed(dx);
                    let beside = around[place(y + dy)][from..].iter().zip(&around[place(y)][REACH..]);
                    for (code, (neighbour, centre)) in of_table.iter_mut().zip(beside) {
                        *code = *code << 1 | u8::from(neighbour > centre);
                    }
                }
                codes.iter_mut().zip(of_table).for_each(|(code, of_table)| code[table] = of_table);
            }
        }
    }
}

/// The grey values of [`COLUMNS`] pixels of a row from column x on, and those around. Border columns are repeated outward.
#[inline(always)]
fn greys_around(row: &[u8], x: usize) -> [u8; AROUND] {
    let inside = x.checked_sub(REACH).and_then(|first| row[first..].first_chunk());
    inside.copied().unwrap_or_else(|| array::from_fn(|i| row[(x + i).saturating_sub(REACH).min(row.len() - 1)]))
}

/// The codes of [`code`] of the pixels at `columns` and `rows`, `[rows][columns]`.
pub(crate) fn codes(image: &Image, columns: Range<usize>, rows: Range<usize>) -> Vec<u8> {
    let mut codes = vec![[0]; columns.len() * rows.len()];
    write_codes(image, [&INNER], columns, rows, &mut codes);
    codes.into_flattened()
}

/// The census code computed from a colour channel (0 red, 1 green, 2 blue) instead of grey values.
///
/// # Panics
/// If (x, y) lies outside the image, or `channel` is above 2.
#[must_use]
pub fn code_of_channel(image: &Image, x: usize, y: usize, channel: usize) -> u8 {
    compare((x, y), &INNER, |x, y| image.rgb_near(x, y)[channel])
}

/// The census code of the eight neighbours two and four pixels away, left and right, above and below: in row order, from the
/// highest bit to the lowest, as [`code`].
///
/// # Panics
/// If (x, y) lies outside the image.
#[must_use]
pub fn outer_code(image: &Image, x: usize, y: usize) -> u8 {
    compare((x, y), &OUTER, |x, y| image.grey_near(x, y))
}

/// One bit for each neighbour of (x, y). `value` is that of a pixel, which may lie outside the image.
fn compare((x, y): (usize, usize), neighbours: &Neighbours, value: impl Fn(isize, isize) -> u8) -> u8 {
    let (x, y) = (x as isize, y as isize);
    let centre = value(x, y);
    neighbours.iter().fold(0, |code, &(dx, dy)| code << 1 | u8::from(value(x + dx, y + dy) > centre))
}

/// The match of a left pixel: the label whose strip of 21x3 census codes differs least. The strip is shortened at the border
/// of the image and has to lie inside both images. The smallest label wins a tie. `None` if no strip lies inside.
///
/// # Panics
/// If (x, y) lies outside the image.
#[must_use]
pub fn find_match(pair: &StereoPair, model: &Model, node: Node) -> Option<Seed> {
    let Node { x, y } = node;
    let size = pair.size();
    let half_width = HALF_LENGTH.min(x).min(size.width - 1 - x);
    let half_height = 1.min(y).min(size.height - 1 - y);
    let score = |label: u16| -> Option<u32> {
        let column = model.matching_column(x, label, size.width)?;
        let inside = column >= half_width && column + half_width < size.width;
        let differing = |dx: usize, row: usize| {
            let left = code(pair.left(), x - half_width + dx, row);
            (left ^ code(pair.right(), column - half_width + dx, row)).count_ones()
        };
        let rows = y - half_height..=y + half_height;
        inside.then(|| rows.map(|row| (0..=2 * half_width).map(|dx| differing(dx, row)).sum::<u32>()).sum())
    };
    let scores = (0..model.labels() as u16).filter_map(|label| Some((score(label)?, label)));
    scores.min().map(|(_, label)| Seed { x, y, label })
}

/// The seed of a plan whose cut starts from the match of that point; `None` for other plans, or without a match.
#[must_use]
pub fn seed(pair: &StereoPair, plan: &Plan) -> Option<Seed> {
    let cut = plan.settings().cut.filter(|cut| cut.seed_start)?;
    let seed = find_match(pair, plan.model(), Node { x: plan.margin() + cut.x, y: cut.y })?;
    Some(Seed { x: cut.x, ..seed })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Profile;

    fn noise(x: usize, y: usize) -> u8 {
        ((x * 7919 + y * 104_729 + x * x * 31 + y * x * 17) % 251) as u8
    }

    fn shifted_pair(width: usize, height: usize, shift: usize) -> StereoPair {
        let view = |offset: usize| {
            let pixel = |i| noise(i % width + offset, i / width);
            Image::from_grey(width, height, (0..width * height).map(pixel).collect::<Vec<_>>()).unwrap()
        };
        StereoPair::new(view(0), view(shift)).unwrap()
    }

    #[test]
    fn bits_come_in_row_order_and_ties_give_0() {
        let image = Image::from_grey(3, 3, [6, 5, 4, 5, 5, 9, 1, 7, 5]).unwrap();
        assert_eq!(code(&image, 1, 1), 0b1000_1010);
        let flat = Image::from_grey(1, 1, [5]).unwrap();
        assert_eq!(code(&flat, 0, 0), 0);
    }

    #[test]
    fn codes_of_many_pixels_are_those_of_single_ones() {
        let pixels: Vec<u8> = (0..1000).map(|i| (i * i * 29 % 50) as u8).collect();
        let image = Image::from_grey(200, 5, pixels).unwrap();
        for (columns, rows) in [(0..200, 0..5), (2..5, 1..3), (70..198, 0..2), (199..200, 4..5)] {
            let singly = rows.clone().flat_map(|y| columns.clone().map(move |x| (x, y)));
            let singly: Vec<u8> = singly.map(|(x, y)| code(&image, x, y)).collect();
            assert_eq!(codes(&image, columns.clone(), rows.clone()), singly);
            let both = rows.clone().flat_map(|y| columns.clone().map(move |x| (x, y)));
            let both: Vec<_> = both.map(|(x, y)| [code(&image, x, y), outer_code(&image, x, y)]).collect();
            let mut found = vec![[0; 2]; both.len()];
            write_codes(&image, [&INNER, &OUTER], columns, rows, &mut found);
            assert_eq!(found, both);
        }
    }

    #[test]
    fn channels_are_compared_apart() {
        let image = Image::from_rgb(2, 1, vec![[0, 5, 9], [1, 5, 8]]).unwrap();
        let codes = |x| [0, 1, 2].map(|channel| code_of_channel(&image, x, 0, channel));
        assert_eq!([codes(0), codes(1)], [[0b0010_1001, 0, 0], [0, 0, 0b1001_0100]]);
    }

    #[test]
    fn the_outer_code_compares_a_cross_of_two_and_four_pixels() {
        let mut pixels = [7; 81];
        (pixels[4], pixels[38], pixels[42], pixels[76]) = (8, 9, 3, 10);
        let image = Image::from_grey(9, 9, pixels).unwrap();
        assert_eq!(outer_code(&image, 4, 4), 0b1001_0001);
        // The pixel at (8, 4) is the right border; the one at (6, 4) is darker, so brighter are all others within reach.
        assert_eq!(outer_code(&image, 6, 4), 0b1111_1111);
        assert_eq!(outer_code(&image, 8, 4), 0b0000_0000);
    }

    #[test]
    fn a_shifted_pair_gives_the_shift() {
        let model = Model::new(Profile::Census, 30).unwrap();
        let found = find_match(&shifted_pair(80, 21, 13), &model, Node { x: 40, y: 10 });
        assert_eq!(found, Some(Seed { x: 40, y: 10, label: 13 }));
    }

    #[test]
    fn tiny_images_have_a_match_at_label_0_and_none_without_candidates() {
        let model = Model::new(Profile::Census, 3).unwrap();
        for (width, height) in [(1, 1), (1, 5), (2, 1), (2, 3)] {
            let pair = shifted_pair(width, height, 0);
            let centre = Node { x: width / 2, y: height / 2 };
            assert_eq!(find_match(&pair, &model, centre).map(|seed| seed.label), Some(0), "{width}x{height}");
            assert_eq!(find_match(&pair, &model.with_min_disparity(5).unwrap(), centre), None);
        }
    }
}
