//! Sub-pixel refinement.

use super::{
    means::{AFTER, BEFORE, write_means},
    offsets::write_offsets,
    unique::remove_specks,
};
use crate::{DisparityMap, Error, IsStopped, StereoPair, memory::Buffer, metrics::check_size};

/// Refines disparities to fractions of a pixel by the images.
///
/// The labels of a slanted surface form steps. Means over 11x11 pixels follow the slope, roughly. From there, the offset is found
/// at which the images fit best, and means are taken again, over 15x15 pixels. The range of disparities stays.
/// docs/algorithms.md compares this with other ways.
///
/// With `unique`, pixels are dropped that [`super::check_unique`] drops, but after the offsets and by the same variances: at the best
/// one of the disparities that are tried.
///
/// # Errors
/// [`Error::WrongSize`] if the map has another size than the pair, [`Error::OutOfMemory`], [`Error::Stopped`].
pub fn subpixel(
    pair: &StereoPair,
    map: DisparityMap,
    unique: bool,
    is_stopped: IsStopped<'_>,
) -> Result<DisparityMap, Error> {
    check_size("the disparity map", map.size(), pair.size())?;
    let Some((least, largest)) = map.range_by_threads() else { return Ok(map) };
    let (size, limits, mut values) = (map.size(), least..=largest, map.into_values());
    let mut means = Buffer::filled_unless(is_stopped, "a map of means", size.pixels(), 0.0)?;
    write_means(size.width, &values, &limits, &BEFORE, &mut means, is_stopped)?;
    write_offsets(pair, &means, &limits, unique, &mut values, is_stopped)?;
    write_means(size.width, &values, &limits, &AFTER, &mut means, is_stopped)?;
    // Makes room for the surfaces.
    drop(values);
    let map = DisparityMap::of(size, means);
    if unique { remove_specks(map) } else { Ok(map) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::never;
    use crate::{Image, Size};

    const SIZE: Size = Size { width: 160, height: 60 };

    /// A random texture between whole columns: cubic, and so not what the refinement interpolates by.
    fn texture(x: f32, y: usize) -> f32 {
        let wave = |length: f32, phase: f32| (std::f32::consts::TAU * (x / length + phase)).sin();
        let row = y as f32;
        128.0 + 40.0 * wave(4.7, 0.37 * row) + 30.0 * wave(7.9, 0.23 * row) + 25.0 * wave(13.1, 0.61 * row)
    }

    /// The two views of a surface, with noise of a few grey values, where the right one is brighter by `brighter`.
    fn views(disparity: impl Fn(usize, usize) -> f32, brighter: f32) -> StereoPair {
        let mut seed = 1_u32;
        let mut noise = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 24) as f32 / 64.0 - 2.0
        };
        let mut view = |grey: &dyn Fn(usize, usize) -> f32| {
            let greys = (0..SIZE.pixels()).map(|i| (grey(i % SIZE.width, i / SIZE.width) + noise()).round() as u8);
            Image::from_grey(SIZE.width, SIZE.height, greys.collect::<Vec<_>>()).unwrap()
        };
        // The left view is resampled, because disparities belong to its pixels.
        let left = view(&|x, y| texture(x as f32 - disparity(x, y), y));
        StereoPair::new(left, view(&|x, y| texture(x as f32, y) + brighter)).unwrap()
    }

    /// The errors of a slanted plane's map away from its borders, given whole disparities.
    fn errors(slope: f32, brighter: f32) -> Vec<f32> {
        let plane = |x: usize, y: usize| 12.0 + slope * x as f32 + 0.031 * y as f32;
        let labels = (0..SIZE.pixels()).map(|i| plane(i % SIZE.width, i / SIZE.width).round()).collect();
        let map = subpixel(&views(plane, brighter), DisparityMap::new(SIZE, labels).unwrap(), false, &never).unwrap();
        let inside = (8..SIZE.height - 8).flat_map(|y| (40..SIZE.width - 8).map(move |x| (x, y)));
        inside.map(|(x, y)| map.at(x, y).unwrap() - plane(x, y)).collect()
    }

    fn rms(errors: &[f32]) -> f32 {
        (errors.iter().map(|error| error * error).sum::<f32>() / errors.len() as f32).sqrt()
    }

    #[test]
    #[cfg_attr(miri, ignore = "takes minutes")]
    fn a_slanted_plane_is_right_to_a_fiftieth_of_a_pixel() {
        for slope in [0.0, 0.013, 0.05, -0.03] {
            let errors = errors(slope, 0.0);
            assert!(rms(&errors) < 0.02, "slope {slope}: {}", rms(&errors));
            let mean = errors.iter().sum::<f32>() / errors.len() as f32;
            assert!(mean.abs() < 0.02, "slope {slope}: {mean} on average");
        }
    }

    #[test]
    #[cfg_attr(miri, ignore = "takes minutes")]
    fn a_brighter_image_changes_hardly_anything() {
        assert!((rms(&errors(0.05, 30.0)) - rms(&errors(0.05, 0.0))).abs() < 0.01);
    }

    /// Whole labels put all pixels into two of the tenths.
    #[test]
    #[cfg_attr(miri, ignore = "takes minutes")]
    fn all_fractions_occur_nearly_as_often() {
        let plane = |x: usize, y: usize| 10.0 + 0.05 * x as f32 + 0.0071 * y as f32;
        let labels = (0..SIZE.pixels()).map(|i| plane(i % SIZE.width, i / SIZE.width).round()).collect();
        let map = subpixel(&views(plane, 0.0), DisparityMap::new(SIZE, labels).unwrap(), false, &never).unwrap();
        let mut tenths = [0_usize; 10];
        // Five whole pixels of disparity, so every true fraction is as frequent.
        for (x, y) in (8..SIZE.height - 8).flat_map(|y| (48..148).map(move |x| (x, y))) {
            tenths[(10.0 * map.at(x, y).unwrap().rem_euclid(1.0)) as usize % 10] += 1;
        }
        let expected = 100 * (SIZE.height - 16) / 10;
        assert!(tenths.iter().all(|&count| 10 * count.abs_diff(expected) <= expected), "{expected}: {tenths:?}");
    }

    #[test]
    fn a_staircase_becomes_a_slope() {
        let size = Size { width: 64, height: 9 };
        let slope = |x: usize| 10.0 + 0.25 * x as f32;
        let steps: Vec<f32> = (0..size.pixels()).map(|i| slope(i % size.width).round()).collect();
        let mut means = vec![0.0; size.pixels()];
        write_means(size.width, &steps, &(10.0..=26.0), &BEFORE, &mut means, &never).unwrap();
        let worst = (8..56).map(|x| (means[4 * size.width + x] - slope(x)).abs()).fold(0.0, f32::max);
        assert!(worst <= 0.25, "{worst}");
    }

    #[test]
    #[cfg_attr(miri, ignore = "takes minutes")]
    fn a_blank_area_keeps_its_disparity() {
        let size = Size { width: 40, height: 20 };
        let blank = || Image::from_grey(size.width, size.height, vec![9; size.pixels()]).unwrap();
        let mut values = vec![5.0; size.pixels()];
        values[0] = 0.0;
        let map = DisparityMap::new(size, values).unwrap();
        let refined = subpixel(&StereoPair::new(blank(), blank()).unwrap(), map.clone(), false, &never).unwrap();
        assert_eq!(refined, map);
    }

    #[test]
    fn edges_and_unknown_pixels_stay() {
        let values = vec![3.0, 3.0, DisparityMap::UNKNOWN, f32::MAX, f32::MIN];
        let map = DisparityMap::new(Size { width: 5, height: 1 }, values).unwrap();
        let blank = || Image::from_grey(5, 1, [9; 5]).unwrap();
        let pair = StereoPair::new(blank(), blank()).unwrap();
        assert_eq!(subpixel(&pair, map.clone(), false, &never).unwrap(), map);
        assert!(
            subpixel(&pair, DisparityMap::new(Size { width: 1, height: 1 }, vec![0.0]).unwrap(), false, &never)
                .is_err()
        );
    }
}
