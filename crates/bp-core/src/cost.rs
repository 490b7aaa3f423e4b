//! Data costs D(p, d) of the profiles, before any normalising or clipping.

use fearless_simd::{Level, Simd, dispatch};

use crate::{
    Error, Image, Model, Profile, Seed, Size, StereoPair, census, census::Neighbours, features, memory::Buffer,
};

/// The per-pixel features that a profile compares, `[height][width]`, of both images.
#[derive(Clone, Debug)]
enum Planes {
    Thesis([Buffer<u8>; 2]),
    Census([Buffer<[u8; 1]>; 2]),
    Mrf([Buffer<[u8; 3]>; 2]),
    Gradient([Buffer<[u8; 2]>; 2]),
    BirchfieldTomasi([Buffer<[u8; 3]>; 2]),
    Census16([Buffer<[u8; 2]>; 2]),
    Census32([Buffer<[u8; 4]>; 2]),
}

/// The data costs of all pixels and labels of a pair. It is allocated once and loaded with one pair after another.
#[derive(Clone, Debug)]
pub struct DataCost {
    size: Size,
    model: Model,
    planes: Planes,
    seed: Option<Seed>,
}

impl DataCost {
    /// Allocates room for pairs of `size`. It holds two black images at first.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn new(size: Size, model: Model) -> Result<Self, Error> {
        let planes = match model.profile() {
            Profile::Thesis => Planes::Thesis(planes(size)?),
            Profile::Census => Planes::Census(planes(size)?),
            Profile::Mrf => Planes::Mrf(planes(size)?),
            Profile::Gradient => Planes::Gradient(planes(size)?),
            Profile::BirchfieldTomasi => Planes::BirchfieldTomasi(planes(size)?),
            Profile::Census16 => Planes::Census16(planes(size)?),
            Profile::Census32 => Planes::Census32(planes(size)?),
        };
        Ok(Self { size, model, planes, seed: None })
    }

    /// The data costs of one pair, without a seed.
    ///
    /// # Errors
    /// As [`DataCost::new`].
    pub fn of_pair(pair: &StereoPair, model: Model) -> Result<Self, Error> {
        let mut cost = Self::new(pair.size(), model)?;
        cost.load(pair, None)?;
        Ok(cost)
    }

    /// Loads a pair. A seed sets the costs around it.
    ///
    /// # Errors
    /// [`Error::WrongSize`] if the pair has another size.
    pub fn load(&mut self, pair: &StereoPair, seed: Option<Seed>) -> Result<(), Error> {
        if pair.size() != self.size {
            return Err(Error::WrongSize { what: "the pair", found: pair.size(), expected: self.size });
        }
        self.seed = seed;
        for (side, view) in [pair.left(), pair.right()].into_iter().enumerate() {
            match &mut self.planes {
                Planes::Thesis(planes) => fill(&mut planes[side], view, |image, x, y| image.grey(x, y)),
                Planes::Census(planes) => write_codes(view, [&census::INNER], &mut planes[side]),
                Planes::Mrf(planes) => planes[side].copy_from_slice(&view.pixels()),
                Planes::Gradient(planes) => fill(&mut planes[side], view, features::gradient),
                Planes::BirchfieldTomasi(planes) => fill(&mut planes[side], view, features::half_samples),
                Planes::Census16(planes) => write_codes(view, [&census::INNER, &census::OUTER], &mut planes[side]),
                Planes::Census32(planes) => fill(&mut planes[side], view, features::census_32),
            }
        }
        Ok(())
    }

    /// D(p, d) of the pixel at (x, y) for one label.
    ///
    /// # Panics
    /// If (x, y) lies outside the image.
    #[must_use]
    #[inline(always)]
    pub fn at(&self, x: usize, y: usize, label: u16) -> u16 {
        if let Some(seed) = self.seed.filter(|seed| seed.touches(x, y)) {
            return if label.abs_diff(seed.label) <= 1 { 0 } else { self.model.profile().max_cost() };
        }
        match self.model.matching_column(x, label, self.size.width) {
            Some(column) => self.compare(y * self.size.width + x, y * self.size.width + column),
            None => self.model.profile().out_of_range_cost(),
        }
    }

    /// The sum of D(p, f_p) over the pixels of row y, which have these labels.
    pub(crate) fn of_row(&self, y: usize, labels: &[u16]) -> u64 {
        dispatch!(Level::new(), simd => simd.vectorize(
            #[inline(always)]
            || (0..).zip(labels).map(|(x, &label)| u64::from(self.at(x, y, label))).sum(),
        ))
    }

    /// The bytes held.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        match &self.planes {
            Planes::Thesis(planes) => planes.iter().map(Buffer::bytes).sum(),
            Planes::Census(planes) => planes.iter().map(Buffer::bytes).sum(),
            Planes::Gradient(planes) | Planes::Census16(planes) => planes.iter().map(Buffer::bytes).sum(),
            Planes::Census32(planes) => planes.iter().map(Buffer::bytes).sum(),
            Planes::Mrf(planes) | Planes::BirchfieldTomasi(planes) => planes.iter().map(Buffer::bytes).sum(),
        }
    }

    /// The cost of matching the left pixel at index `l` with the right one at index `r`.
    #[inline(always)]
    fn compare(&self, l: usize, r: usize) -> u16 {
        match &self.planes {
            Planes::Thesis([left, right]) => features::truncated_difference(left[l], right[r]),
            Planes::Census([left, right]) => features::hamming_distance(left[l], right[r]).min(6),
            Planes::Mrf([left, right]) => features::sum_of_differences(left[l], right[r]),
            Planes::Gradient([left, right]) => features::gradient_difference(left[l], right[r]),
            Planes::BirchfieldTomasi([left, right]) => features::sampling_insensitive_difference(left[l], right[r]),
            Planes::Census16([left, right]) => features::hamming_distance(left[l], right[r]).min(15),
            Planes::Census32([left, right]) => features::hamming_distance(left[l], right[r]),
        }
    }
}

fn planes<T: Copy + Default + Send + Sync>(size: Size) -> Result<[Buffer<T>; 2], Error> {
    let plane = || Buffer::filled("images", size.pixels(), T::default());
    Ok([plane()?, plane()?])
}

fn write_codes<const TABLES: usize>(view: &Image, tables: [&Neighbours; TABLES], plane: &mut [[u8; TABLES]]) {
    census::write_codes(view, tables, 0..view.size().width, 0..view.size().height, plane);
}

fn fill<T>(plane: &mut [T], view: &Image, value: impl Fn(&Image, usize, usize) -> T) {
    for (y, row) in plane.chunks_exact_mut(view.size().width).enumerate() {
        for (x, out) in row.iter_mut().enumerate() {
            *out = value(view, x, y);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cost(profile: Profile, left: &[u8], right: &[u8], seed: Option<Seed>) -> DataCost {
        let grey = |values| Image::from_grey(left.len(), 1, values).unwrap();
        let pair = StereoPair::new(grey(left), grey(right)).unwrap();
        let mut cost = DataCost::new(pair.size(), Model::new(profile, 3).unwrap()).unwrap();
        cost.load(&pair, seed).unwrap();
        cost
    }

    #[test]
    fn thesis_costs_are_rounded_tenths() {
        let rounded: Vec<u16> = (0..=16).map(|v| cost(Profile::Thesis, &[v], &[0], None).at(0, 0, 0)).collect();
        assert_eq!(rounded, [0, 1, 1, 2, 3, 4, 4, 5, 6, 6, 7, 8, 8, 9, 10, 11, 11]);
    }

    #[test]
    fn costs_outside_the_right_image_are_the_profiles() {
        let halves =
            [(Profile::Gradient, 10), (Profile::BirchfieldTomasi, 15), (Profile::Census16, 6), (Profile::Census32, 12)];
        let wholes = [(Profile::Thesis, 11), (Profile::Census, 3), (Profile::Mrf, 765)];
        for (profile, expected) in wholes.into_iter().chain(halves) {
            let cost = cost(profile, &[9, 9], &[9, 9], None);
            assert_eq!([cost.at(0, 0, 1), cost.at(1, 0, 2)], [expected; 2], "{}", profile.name());
            assert_eq!(cost.at(1, 0, 1), 0);
        }
        assert_eq!(cost(Profile::Mrf, &[200], &[50], None).at(0, 0, 0), 450);
    }

    #[test]
    fn inner_codes_of_equal_channels_count_thrice() {
        let of = |profile| cost(profile, &[9, 9, 9, 0, 0], &[0, 9, 0, 9, 5], None);
        let [census, both, rgb] = [Profile::Census, Profile::Census16, Profile::Census32].map(of);
        assert_eq!([0, 1, 2, 3, 4].map(|x| census.at(x, 0, 0)), [3, 0, 6, 3, 3]);
        for x in 0..5 {
            assert_eq!(rgb.at(x, 0, 0), both.at(x, 0, 0) + 2 * census.at(x, 0, 0), "{x}");
        }
    }

    /// Matching an image in tiles relies on this.
    #[test]
    #[cfg_attr(miri, ignore = "takes minutes")]
    fn costs_of_a_strip_are_those_of_the_whole_image() {
        let noise = |i: usize| [7919, 104_729, 31].map(|factor| (i * i * factor / 7 % 251) as u8);
        let view = |first| Image::from_rgb(5, 9, (first..first + 45).map(noise).collect()).unwrap();
        let pair = StereoPair::new(view(0), view(100)).unwrap();
        for (profile, rows) in Profile::ALL.into_iter().flat_map(|p| [0..2, 1..4, 4..5, 8..9].map(|rows| (p, rows))) {
            let model = Model::new(profile, 3).unwrap();
            let whole = DataCost::of_pair(&pair, model).unwrap();
            let strip = DataCost::of_pair(&pair.strip(rows.clone()), model).unwrap();
            for (x, y, label) in rows.clone().flat_map(|y| (0..15).map(move |i| (i / 3, y, i as u16 % 3))) {
                let found = strip.at(x, y - rows.start, label);
                assert_eq!(found, whole.at(x, y, label), "{} {rows:?} ({x}, {y})", profile.name());
            }
        }
    }

    #[test]
    fn codes_of_16_bits_count_to_15_and_those_of_32_to_32() {
        // In the middle of the left image all neighbours are brighter, in the right one none.
        let mut views = [[9; 81], [9; 81]];
        (views[0][40], views[1][40]) = (0, 10);
        let [left, right] = views.map(|view| Image::from_grey(9, 9, view).unwrap());
        let pair = StereoPair::new(left, right).unwrap();
        let at = |profile, x, y| DataCost::of_pair(&pair, Model::new(profile, 1).unwrap()).unwrap().at(x, y, 0);
        assert_eq!([Profile::Census16, Profile::Census32].map(|profile| at(profile, 4, 4)), [15, 32]);
        // Beside it, only the middle differs; it counts in all three channels, or four columns further, once.
        assert_eq!([Profile::Census16, Profile::Census32].map(|profile| at(profile, 5, 4)), [1, 3]);
        assert_eq!([Profile::Census16, Profile::Census32].map(|profile| at(profile, 8, 4)), [1, 1]);
    }

    #[test]
    fn a_seed_fixes_its_four_nodes_only() {
        let seed = Seed { x: 2, y: 0, label: 2 };
        let cost = cost(Profile::Census, &[0, 50, 0, 99], &[7, 7, 7, 7], Some(seed));
        assert_eq!([0, 1, 2].map(|label| cost.at(1, 0, label)), [6, 0, 0]);
        assert_eq!(cost.at(2, 0, 0), 6);
        assert_eq!(cost.at(3, 0, 0), cost.compare(3, 3));
        assert!(!seed.touches(0, 0) && !seed.touches(3, 0) && !seed.touches(2, 1));
    }
}
