//! Removal of small surfaces, which are usually wrong.

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
    // Pixels of a surface come after its first one, so each is one step away from it, if those before are. From now on, the
    // first one holds the number of pixels, added to that of the image.
    for pixel in 0..pixels {
        let before = surfaces[pixel];
        let first = if before == pixel || surfaces[before] >= pixels { before } else { surfaces[before] };
        surfaces[pixel] = if first == pixel { pixels } else { first };
        surfaces[first] += 1;
    }
    let count = |pixel: usize| {
        let holds = surfaces[pixel];
        (if holds >= pixels { holds } else { surfaces[holds] }) - pixels
    };
    Ok(map.replaced(|values| {
        for (_, value) in values.iter_mut().enumerate().filter(|(pixel, _)| count(*pixel) < least) {
            *value = DisparityMap::UNKNOWN;
        }
    }))
}

/// Sets `surfaces` to an earlier pixel of the same surface for each pixel, or the pixel itself if it is the first.
fn join(values: &[f32], width: usize, surfaces: &mut [usize]) {
    // The difference of unknown pixels is infinite, or none.
    let agree = |a: usize, b: usize| (values[a] - values[b]).abs() <= AGREE;
    for start in (0..values.len()).step_by(width) {
        for pixel in start..start + width {
            let left = (pixel > start && agree(pixel - 1, pixel)).then(|| surfaces[pixel - 1]);
            let above = (start > 0 && agree(pixel - width, pixel)).then(|| surfaces[pixel - width]);
            surfaces[pixel] = match (left, above) {
                (Some(left), Some(above)) if left != above => {
                    let (left, above) = (first(surfaces, left), first(surfaces, above));
                    surfaces[left.max(above)] = left.min(above);
                    left.min(above)
                }
                (Some(before), _) | (None, Some(before)) => before,
                (None, None) => pixel,
            };
        }
    }
}

/// The first pixel of the surface that a pixel belongs to, as far as it is joined.
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
