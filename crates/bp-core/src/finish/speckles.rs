//! Removal of small surfaces, which are usually wrong.

use std::ops::Range;

use super::check::AGREE;
use crate::{DisparityMap, Error, memory::Buffer};

/// Makes surfaces of fewer than `least` pixels unknown. A surface consists of adjacent pixels, each of which differs from
/// the next by no more than [`AGREE`].
///
/// # Errors
/// [`Error::OutOfMemory`].
pub fn remove_speckles(map: DisparityMap, least: usize) -> Result<DisparityMap, Error> {
    let (width, pixels) = (map.size().width, map.size().pixels());
    let mut surfaces = Buffer::filled("surfaces", pixels, 0)?;
    join(map.values(), width, &mut surfaces);
    // Runs of a surface come after its first one, so each is one step away from it, if those before are. From now on, the
    // first one holds the number of pixels, added to that of the image.
    for Range { start, end } in runs(map.values(), width, 0) {
        let before = surfaces[start];
        let first = if before == start || surfaces[before] >= pixels { before } else { surfaces[before] };
        surfaces[start] = if first == start { pixels } else { first };
        surfaces[first] += end - start;
    }
    let count = |start: usize| {
        let holds = surfaces[start];
        (if holds >= pixels { holds } else { surfaces[holds] }) - pixels
    };
    Ok(map.replaced(|values| {
        let mut start = 0;
        for run in values.chunks_exact_mut(width).flat_map(|row| row.chunk_by_mut(agree)) {
            let end = start + run.len();
            if run[0].is_finite() && count(start) < least {
                run.fill(DisparityMap::UNKNOWN);
            }
            start = end;
        }
    }))
}

/// Whether adjacent pixels belong to the same surface. The difference of unknown pixels is infinite, or none.
fn agree(a: &f32, b: &f32) -> bool {
    (a - b).abs() <= AGREE
}

/// The longest runs of pixels that belong to the same surface in each row, if the first pixel of the rows is the given one.
fn runs(rows: &[f32], width: usize, first: usize) -> impl Iterator<Item = Range<usize>> {
    let all = rows.chunks_exact(width).flat_map(|row| row.chunk_by(agree)).scan(first, |end, run| {
        let start = *end;
        *end += run.len();
        Some((start..*end, run[0]))
    });
    all.filter(|(_, disparity)| disparity.is_finite()).map(|(run, _)| run)
}

/// Sets `surfaces` to the first pixel of an earlier run of the same surface for the first pixel of each run, or that pixel
/// itself if there is none.
fn join(values: &[f32], width: usize, surfaces: &mut [usize]) {
    let (mut above, mut own) = (vec![], vec![]);
    for (y, row) in values.chunks_exact(width).enumerate() {
        own.extend(runs(row, width, y * width));
        own.iter().for_each(|run: &Range<usize>| surfaces[run.start] = run.start);
        let mut others = above.iter().map(|run: &Range<usize>| run.start + width..run.end + width).peekable();
        for run in &own {
            let mut touch = |other: &Range<usize>| {
                let mut shared = run.start.max(other.start)..run.end.min(other.end);
                if shared.any(|pixel| agree(&values[pixel - width], &values[pixel])) {
                    let [a, b] = [run.start, other.start - width].map(|run| first(surfaces, run));
                    surfaces[a.max(b)] = a.min(b);
                }
            };
            while let Some(other) = others.next_if(|other| other.end <= run.end) {
                touch(&other);
            }
            others.peek().into_iter().for_each(touch);
        }
        std::mem::swap(&mut above, &mut own);
        own.clear();
    }
}

/// The first pixel of the surface that a run belongs to, as far as it is joined.
fn first(surfaces: &mut [usize], mut pixel: usize) -> usize {
    while surfaces[pixel] != pixel {
        // Every second step becomes one of two, so that paths stay short.
        surfaces[pixel] = surfaces[surfaces[pixel]];
        pixel = surfaces[pixel];
    }
    pixel
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Size;

    const NONE: f32 = DisparityMap::UNKNOWN;

    #[test]
    fn surfaces_join_over_sides_and_small_steps() {
        let values = vec![
            1.0, 2.0, 9.0, //
            5.0, 3.0, NONE, //
            1.0, 5.0, 9.0,
        ];
        let map = DisparityMap::new(Size { width: 3, height: 3 }, values).unwrap();
        let left = remove_speckles(map.clone(), 3).unwrap();
        assert_eq!(left.values(), [1.0, 2.0, NONE, NONE, 3.0, NONE, NONE, NONE, NONE]);
        assert_eq!(remove_speckles(map.clone(), 1).unwrap(), map);
    }

    /// The surface that a pixel belongs to, found by going from neighbour to neighbour.
    fn flooded(map: &DisparityMap, start: usize) -> Vec<usize> {
        let (Size { width, height }, values) = (map.size(), map.values());
        let mut surface = vec![start];
        let mut next = 0;
        while let Some(&pixel) = surface.get(next) {
            next += 1;
            let (x, y) = (pixel % width, pixel / width);
            let sides = [
                (x > 0, pixel.wrapping_sub(1)),
                (x + 1 < width, pixel + 1),
                (y > 0, pixel.wrapping_sub(width)),
                (y + 1 < height, pixel + width),
            ];
            for (_, other) in sides.into_iter().filter(|(exists, _)| *exists) {
                if !surface.contains(&other) && (values[other] - values[pixel]).abs() <= AGREE {
                    surface.push(other);
                }
            }
        }
        surface
    }

    #[test]
    #[cfg_attr(miri, ignore = "takes minutes")]
    fn surfaces_of_any_form_count_as_a_whole() {
        let mut seed = 1_u32;
        let mut random = |values: u32| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 24) % values
        };
        for (width, height) in [(1, 1), (1, 9), (9, 1), (7, 5), (12, 20), (23, 17)].repeat(5) {
            let value = |_| if random(5) == 0 { NONE } else { 2.5 * random(3) as f32 };
            let values = (0..width * height).map(value).collect();
            let map = DisparityMap::new(Size { width, height }, values).unwrap();
            for least in [2, 5, 12] {
                let left = remove_speckles(map.clone(), least).unwrap();
                for (pixel, (&left, &value)) in left.values().iter().zip(map.values()).enumerate() {
                    let expected = if flooded(&map, pixel).len() < least { NONE } else { value };
                    assert_eq!(left, expected, "{width}x{height}, {least}, pixel {pixel}");
                }
            }
        }
    }
}
