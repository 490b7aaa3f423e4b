//! Census codes of a whole rectangle. It reads each grey value once, then computes the codes row by row, with eight
//! comparisons per code.

use std::ops::Range;

use crate::Image;

/// The codes of the pixels at `columns` and `rows`, `[rows][columns]`; see [`crate::census::code`].
pub(super) fn of_rectangle(image: &Image, columns: Range<usize>, rows: Range<usize>) -> Vec<u8> {
    let (width, height) = (columns.len(), rows.len());
    let wide = width + 2;
    let near = |start: usize, count: usize| (0..count as isize + 2).map(move |i| start as isize - 1 + i);
    let row = |y: isize| near(columns.start, width).map(move |x| image.grey_near(x, y));
    let greys: Vec<u8> = near(rows.start, height).flat_map(row).collect();
    let mut codes = vec![0; width * height];
    for (y, codes) in codes.chunks_exact_mut(width).enumerate() {
        let centres = &greys[(y + 1) * wide + 1..][..width];
        for (dx, dy) in [(0, 0), (1, 0), (2, 0), (0, 1), (2, 1), (0, 2), (1, 2), (2, 2)] {
            let neighbours = &greys[(y + dy) * wide + dx..][..width];
            for ((code, neighbour), centre) in codes.iter_mut().zip(neighbours).zip(centres) {
                *code = *code << 1 | u8::from(neighbour > centre);
            }
        }
    }
    codes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::census;

    #[test]
    fn they_are_those_of_single_pixels() {
        let pixels: Vec<u8> = (0..35).map(|i| (i * i * 29 % 50) as u8).collect();
        let image = Image::from_grey(7, 5, &pixels).unwrap();
        for (columns, rows) in [(0..7, 0..5), (2..5, 1..3), (6..7, 4..5)] {
            let singly = rows.clone().flat_map(|y| columns.clone().map(move |x| (x, y)));
            let singly: Vec<u8> = singly.map(|(x, y)| census::code(&image, x, y)).collect();
            assert_eq!(of_rectangle(&image, columns, rows), singly);
        }
    }
}
