//! The census transform (Zabih and Woodfill 1994) and the match that it finds for the image's centre.

use std::{array, ops::Range};

use crate::{Image, Model, Node, StereoPair, image::grey};

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
    compare_window(image, Node { x, y }, 1, grey) as u8
}

/// Writes the codes of the pixels at `columns` and `rows`, `[rows][columns]`; see [`code`]. It reads each grey value once, in
/// runs of columns from top to bottom.
pub(crate) fn write_codes(image: &Image, columns: Range<usize>, rows: Range<usize>, codes: &mut [u8]) {
    const COLUMNS: usize = 64;
    let width = columns.len();
    for (x, first) in columns.zip(0..).step_by(COLUMNS) {
        let greys = |y: isize| -> [u8; COLUMNS + 2] {
            let row = image.row_near(y);
            array::from_fn(|i| grey(row[(x + i).saturating_sub(1).min(row.len() - 1)]))
        };
        let [mut above, mut middle] = [-1, 0].map(|dy| greys(rows.start as isize + dy));
        for (y, codes) in rows.clone().zip(codes.chunks_exact_mut(width)) {
            let below = greys(y as isize + 1);
            let codes = &mut codes[first..width.min(first + COLUMNS)];
            codes.fill(0);
            for (row, dx) in [
                (&above, 0),
                (&above, 1),
                (&above, 2),
                (&middle, 0),
                (&middle, 2),
                (&below, 0),
                (&below, 1),
                (&below, 2),
            ] {
                for ((code, neighbour), centre) in codes.iter_mut().zip(&row[dx..]).zip(&middle[1..]) {
                    *code = *code << 1 | u8::from(neighbour > centre);
                }
            }
            (above, middle) = (middle, below);
        }
    }
}

/// The codes of [`write_codes`].
pub(crate) fn codes(image: &Image, columns: Range<usize>, rows: Range<usize>) -> Vec<u8> {
    let mut codes = vec![0; columns.len() * rows.len()];
    write_codes(image, columns, rows, &mut codes);
    codes
}

/// The census code computed from a colour channel (0 red, 1 green, 2 blue) instead of grey values.
///
/// # Panics
/// If (x, y) lies outside the image, or `channel` is above 2.
#[must_use]
pub fn code_of_channel(image: &Image, x: usize, y: usize, channel: usize) -> u8 {
    compare_window(image, Node { x, y }, 1, |colour| colour[channel]) as u8
}

/// The census code of the 24 neighbours in a 5x5 window, in 24 bits.
///
/// # Panics
/// If (x, y) lies outside the image.
#[must_use]
pub fn code_5x5(image: &Image, x: usize, y: usize) -> u32 {
    compare_window(image, Node { x, y }, 2, grey)
}

/// One bit for each neighbour at most `reach` columns and rows away. `value` converts colours to the values compared.
fn compare_window(image: &Image, node: Node, reach: isize, value: impl Fn([u8; 3]) -> u8) -> u32 {
    let Node { x, y } = node;
    let centre = value(image.rgb(x, y));
    let last = image.size().width as isize - 1;
    let mut code = 0;
    for dy in -reach..=reach {
        let row = image.row_near(y as isize + dy);
        for dx in (-reach..=reach).filter(|&dx| (dx, dy) != (0, 0)) {
            let neighbour = value(row[(x as isize + dx).clamp(0, last) as usize]);
            code = code << 1 | u32::from(neighbour > centre);
        }
    }
    code
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
            Image::from_grey(width, height, &(0..width * height).map(pixel).collect::<Vec<_>>()).unwrap()
        };
        StereoPair::new(view(0), view(shift)).unwrap()
    }

    #[test]
    fn bits_come_in_row_order_and_ties_give_0() {
        let image = Image::from_grey(3, 3, &[6, 5, 4, 5, 5, 9, 1, 7, 5]).unwrap();
        assert_eq!(code(&image, 1, 1), 0b1000_1010);
        let flat = Image::from_grey(1, 1, &[5]).unwrap();
        assert_eq!(code(&flat, 0, 0), 0);
    }

    #[test]
    fn codes_of_many_pixels_are_those_of_single_ones() {
        let pixels: Vec<u8> = (0..1000).map(|i| (i * i * 29 % 50) as u8).collect();
        let image = Image::from_grey(200, 5, &pixels).unwrap();
        for (columns, rows) in [(0..200, 0..5), (2..5, 1..3), (70..198, 0..2), (199..200, 4..5)] {
            let singly = rows.clone().flat_map(|y| columns.clone().map(move |x| (x, y)));
            let singly: Vec<u8> = singly.map(|(x, y)| code(&image, x, y)).collect();
            assert_eq!(codes(&image, columns, rows), singly);
        }
    }

    #[test]
    fn channels_are_compared_apart() {
        let image = Image::from_rgb(2, 1, vec![[0, 5, 9], [1, 5, 8]]).unwrap();
        let codes = |x| [0, 1, 2].map(|channel| code_of_channel(&image, x, 0, channel));
        assert_eq!([codes(0), codes(1)], [[0b0010_1001, 0, 0], [0, 0, 0b1001_0100]]);
    }

    #[test]
    fn a_window_of_5x5_is_compared_as_far_as_its_corners() {
        let mut pixels = [7; 25];
        (pixels[0], pixels[13], pixels[24]) = (8, 9, 10);
        let image = Image::from_grey(5, 5, &pixels).unwrap();
        assert_eq!(code_5x5(&image, 2, 2), 1 << 23 | 1 << 11 | 1);
        // The corner is repeated outward.
        assert_eq!(code_5x5(&image, 1, 1), 0b1100_0110_0000_0000_0010_0000);
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
