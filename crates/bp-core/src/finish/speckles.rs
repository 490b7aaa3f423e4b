//! Removal of small surfaces, which are usually wrong.

use super::check::AGREE;
use crate::{DisparityMap, Error, memory};

/// Makes surfaces of fewer than `least` pixels unknown. A surface consists of adjacent pixels, each of which differs from
/// the next by no more than [`AGREE`].
///
/// # Errors
/// [`Error::OutOfMemory`].
pub fn remove_speckles(map: DisparityMap, least: usize) -> Result<DisparityMap, Error> {
    let (width, pixels) = (map.size().width, map.size().pixels());
    let mut seen = memory::filled("surfaces", pixels, false)?;
    // A surface may contain all pixels, but no pixel is pushed twice.
    let mut surface = memory::filled("surfaces", pixels, 0)?;
    Ok(map.replaced(|values| {
        for start in 0..pixels {
            if seen[start] || !values[start].is_finite() {
                continue;
            }
            collect(values, width, start, &mut seen, &mut surface);
            if surface.len() < least {
                surface.iter().for_each(|&pixel| values[pixel] = DisparityMap::UNKNOWN);
            }
        }
    }))
}

/// Sets `surface` to the pixels of the surface that `start` belongs to, and marks them as seen.
fn collect(values: &[f32], width: usize, start: usize, seen: &mut [bool], surface: &mut Vec<usize>) {
    surface.clear();
    surface.push(start);
    seen[start] = true;
    let mut next = 0;
    while let Some(&pixel) = surface.get(next) {
        next += 1;
        let x = pixel % width;
        let sides = [
            (x > 0).then(|| pixel - 1),
            (x + 1 < width).then_some(pixel + 1),
            pixel.checked_sub(width),
            (pixel + width < values.len()).then_some(pixel + width),
        ];
        for other in sides.into_iter().flatten() {
            // The difference to an unknown pixel is infinite.
            if !seen[other] && (values[other] - values[pixel]).abs() <= AGREE {
                seen[other] = true;
                surface.push(other);
            }
        }
    }
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
}
