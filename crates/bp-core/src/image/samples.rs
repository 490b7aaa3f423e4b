//! Images whose values have any range, as satellites and scientific cameras send them.

use rayon::prelude::*;

use super::{Image, scaled};
use crate::{
    Error, Size,
    memory::{self, Buffer},
};

/// This share of all values becomes black, and as many white. A few bright roofs or dead pixels would leave no shades for the
/// others.
const CLIPPED: f64 = 0.005;

/// An image of floats with any range of values. Values that are not finite are missing.
#[derive(Clone, Debug, PartialEq)]
pub struct Samples {
    size: Size,
    /// 1 for grey, 3 for colours.
    channels: usize,
    /// `[height][width][channels]`.
    values: Vec<f32>,
}

impl Samples {
    /// Bytes of a value.
    pub const VALUE_BYTES: u64 = size_of::<f32>() as u64;

    /// An image from its values, `[height][width]`, or `[height][width][3]` for colours.
    ///
    /// # Errors
    /// [`Error::PixelCount`] if there are neither as many values as pixels, nor three times as many.
    pub fn new(size: Size, values: Vec<f32>) -> Result<Self, Error> {
        let channels = [1, 3].into_iter().find(|channels| values.len() == channels * size.pixels());
        let channels = channels.ok_or(Error::PixelCount { size, found: values.len() })?;
        Ok(Self { size, channels, values })
    }

    /// Width and height.
    #[must_use]
    pub fn size(&self) -> Size {
        self.size
    }

    /// The bytes held.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        memory::bytes(&self.values)
    }

    /// The pixels of which all values are there, `[height][width]`; `None` if these are all pixels.
    #[must_use]
    pub fn valid(&self) -> Option<Vec<bool>> {
        let is_valid = |pixel: &[f32]| pixel.iter().all(|value| value.is_finite());
        let pixels = self.values.chunks_exact(self.channels);
        (!is_valid(&self.values)).then(|| pixels.map(is_valid).collect())
    }

    /// Makes the values of the pixels missing that are not valid, `[height][width]`; pixels beyond its end stay.
    pub fn restrict(&mut self, valid: &[bool]) {
        let pixels = self.values.chunks_exact_mut(self.channels).zip(valid);
        pixels.filter(|(_, valid)| !**valid).for_each(|(pixel, _)| pixel.fill(f32::NAN));
    }

    /// The image in 8 bits. Missing values become black.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn stretched(self, stretch: &Stretch) -> Result<Image, Error> {
        let Self { size: Size { width, height }, channels, values } = self;
        let mut shades = Buffer::filled("shades", values.len(), 0)?;
        shades.par_iter_mut().zip(&values).for_each(|(shade, &value)| *shade = stretch.shade(value));
        drop(values);
        if channels == 1 { Image::of_greys(width, height, shades) } else { Image::of_colours(width, height, shades) }
    }
}

/// How values of any range become values of 8 bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    black: f32,
    factor: f64,
}

impl Stretch {
    /// One stretch for images that belong together: the 0.5 % darkest of all their values become black, the 0.5 % brightest white.
    #[must_use]
    pub fn of(images: &[&Samples]) -> Self {
        let values = images.iter().flat_map(|image| &image.values).copied();
        let [black, white] = ends(values.filter(|value| value.is_finite()));
        let range = f64::from(white) - f64::from(black);
        Self { black, factor: if range > 0.0 { 255.0 / range } else { 0.0 } }
    }

    fn shade(&self, value: f32) -> u8 {
        let above = f64::from(value) - f64::from(self.black);
        if value.is_finite() { scaled((above * self.factor) as f32, 1.0) } else { 0 }
    }
}

/// The values that [`CLIPPED`] of all lie below and above; zeros if there are none. Counts instead of sorting, which would need
/// memory for another copy.
fn ends(values: impl Iterator<Item = f32> + Clone) -> [f32; 2] {
    let coarse = count(values.clone().map(|value| order(value) >> 16));
    let total: u64 = coarse.iter().sum();
    let Some(last) = total.checked_sub(1) else { return [0.0; 2] };
    let clipped = (CLIPPED * last as f64) as u64;
    [clipped, last - clipped].map(|rank| {
        let (high, rank) = ranked(&coarse, rank);
        let within = values.clone().map(order).filter(|order| order >> 16 == high);
        let (low, _) = ranked(&count(within.map(|order| order & 0xffff)), rank);
        of_order(high << 16 | low)
    })
}

/// How often each index of 16 bits occurs.
fn count(indices: impl Iterator<Item = u32>) -> Vec<u64> {
    let mut counts = vec![0; 1 << 16];
    indices.for_each(|index| counts[index as usize] += 1);
    counts
}

/// The index of the value of this rank, and its rank among those with the same index.
fn ranked(counts: &[u64], mut rank: u64) -> (u32, u64) {
    let mut index = 0;
    while counts[index] <= rank {
        rank -= counts[index];
        index += 1;
    }
    (index as u32, rank)
}

/// A number that is larger for larger floats.
fn order(value: f32) -> u32 {
    let bits = value.to_bits();
    if value.is_sign_negative() { !bits } else { bits | 1 << 31 }
}

/// The float of such a number.
fn of_order(order: u32) -> f32 {
    f32::from_bits(if order >> 31 == 0 { !order } else { order & !(1 << 31) })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(values: &[f32]) -> Samples {
        Samples::new(Size { width: values.len(), height: 1 }, values.to_vec()).unwrap()
    }

    #[test]
    fn ends_are_those_of_the_sorted_values() {
        let mut random = fastrand::Rng::with_seed(7);
        for count in [1, 2, 100, 201, 1000, 4321] {
            let mut values: Vec<f32> = (0..count).map(|_| (random.f32() - 0.5) * 1e4_f32.powf(random.f32())).collect();
            let found = ends(values.iter().copied());
            values.sort_by(f32::total_cmp);
            let clipped = (count - 1) / 200;
            assert_eq!(found, [values[clipped], values[count - 1 - clipped]], "{count}");
        }
    }

    #[test]
    fn both_images_have_one_scale_and_what_is_missing_is_black() {
        let [left, right] = [grey(&[300.0, 700.0, f32::NAN, 500.0]), grey(&[500.0, 300.0, f32::INFINITY, 700.0])];
        let stretch = Stretch::of(&[&left, &right]);
        assert_eq!(left.valid(), Some(vec![true, true, false, true]));
        assert_eq!(left.stretched(&stretch).unwrap().greys(), [0, 255, 0, 128]);
        assert_eq!(right.stretched(&stretch).unwrap().greys(), [128, 0, 0, 255]);
        // The scale is that of most values.
        let mut values: Vec<f32> = (0..1000_u16).map(f32::from).collect();
        values[999] = 1e30;
        let many = grey(&values);
        assert_eq!(many.valid(), None);
        let stretch = Stretch::of(&[&many]);
        let shades = many.stretched(&stretch).unwrap();
        assert_eq!([3, 4, 499, 995, 999].map(|x| shades.grey(x, 0)), [0, 0, 127, 255, 255]);
    }

    #[test]
    fn odd_values_have_shades_too() {
        for (values, expected) in [
            (vec![7.0; 3], [0; 3]),
            (vec![f32::NAN; 3], [0; 3]),
            (vec![f32::MIN, 0.0, f32::MAX], [0, 128, 255]),
            (vec![0.0, f32::from_bits(1), f32::from_bits(2)], [0, 128, 255]),
        ] {
            let image = grey(&values);
            let stretch = Stretch::of(&[&image]);
            assert_eq!(image.stretched(&stretch).unwrap().greys(), expected, "{values:?}");
        }
        let size = Size { width: 2, height: 1 };
        let coloured = Samples::new(size, vec![0.0, 5.0, 10.0, f32::NAN, 0.0, 0.0]).unwrap();
        assert_eq!(coloured.valid(), Some(vec![true, false]));
        let stretch = Stretch::of(&[&coloured]);
        assert_eq!(*coloured.stretched(&stretch).unwrap().pixels(), [[0, 128, 255], [0; 3]]);
        assert!(Samples::new(size, vec![0.0; 4]).is_err());
    }
}
