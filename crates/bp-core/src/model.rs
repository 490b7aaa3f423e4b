//! The model: labels, data cost profile and smoothness of a Markov random field on a grid.

use crate::{
    EdgeLevels, Error, Image, Smoothness,
    limits::{MAX_LABELS, MAX_SIDE, MAX_TRUNCATION},
};

/// A data cost D(p, d) and the smoothness that goes with it, all in whole units.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Profile {
    /// The truncated absolute grey difference, in tenths of the unit used in the literature: `(7 min(|Il - Ir|, 15) + 5) div 10`,
    /// after Felzenszwalb and Huttenlocher (2006): lambda 0.07, tau 15, s 1, K 1.7.
    Thesis,
    /// `min(Hamming distance of 3x3 census codes, 6)`; the census transform is Zabih and Woodfill's (1994).
    Census,
    /// The sum of absolute differences over R, G and B, not truncated: the default energy of the Middlebury MRF code
    /// (Szeliski et al. 2008).
    Mrf,
    /// Truncated absolute differences of grey values and of their horizontal gradients,
    /// `(3 min(|Il - Ir|, 20) + 35 min(|Gl - Gr|, 4) + 5) div 10` with `G(x) = (256 + I(x + 1) - I(x - 1)) div 2`.
    /// Scharstein (1994) matched by gradients, Bleyer, Rhemann and Rother (2011) by a truncated sum of both; the
    /// constants are ours.
    Gradient,
    /// The grey difference that is insensitive to sampling (Birchfield and Tomasi 1998), `(15 min(d, 20) + 5) div 10`.
    /// Here d is the distance of one image's grey value from the range of the other's around the match. That range
    /// spans I(x) and the half-pixel values `(I(x) + I(x - 1) + 1) div 2` and `(I(x) + I(x + 1) + 1) div 2`. Of the two
    /// directions, the smaller distance counts.
    BirchfieldTomasi,
    /// `min(Hamming distance of census codes of 16 bits, 15)`: the 3x3 code, and eight neighbours two and four pixels away; see
    /// [`Profile::Census`] and [`crate::census::outer_code`]. With 15, and not 16, a byte holds the sum of 16 pixels.
    Census16,
    /// The sum of the Hamming distances of the 3x3 census codes of R, G and B, and of the outer code of the grey values; see
    /// [`Profile::Census16`].
    Census32,
}

impl Profile {
    /// All profiles.
    pub const ALL: [Self; 7] =
        [Self::Thesis, Self::Census, Self::Mrf, Self::Gradient, Self::BirchfieldTomasi, Self::Census16, Self::Census32];

    /// The name used in options and records.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Thesis => "thesis",
            Self::Census => "census",
            Self::Mrf => "mrf",
            Self::Gradient => "gradient",
            Self::BirchfieldTomasi => "birchfield-tomasi",
            Self::Census16 => "census16",
            Self::Census32 => "census32",
        }
    }

    /// How many bytes it compares per pixel.
    #[must_use]
    pub fn channels(self) -> usize {
        match self {
            Self::Thesis | Self::Census => 1,
            Self::Gradient | Self::Census16 => 2,
            Self::Mrf | Self::BirchfieldTomasi => 3,
            Self::Census32 => 4,
        }
    }

    /// Whether it compares colours. The others compare grey values.
    #[must_use]
    pub fn compares_colours(self) -> bool {
        matches!(self, Self::Mrf | Self::Census32)
    }

    /// Bytes per pixel of what it compares of an image.
    #[must_use]
    pub fn image_bytes(self) -> u64 {
        if self.compares_colours() { Image::COLOUR_BYTES } else { Image::GREY_BYTES }
    }

    /// The largest data cost.
    #[must_use]
    pub fn max_cost(self) -> u16 {
        match self {
            Self::Thesis => 11,
            Self::Census => 6,
            Self::Mrf => 765,
            Self::Gradient => 20,
            Self::BirchfieldTomasi => 30,
            Self::Census16 => 15,
            Self::Census32 => 32,
        }
    }

    /// The data cost of a label whose match lies outside the right image.
    #[must_use]
    pub fn out_of_range_cost(self) -> u16 {
        match self {
            Self::Thesis | Self::Mrf => self.max_cost(),
            Self::Census | Self::Gradient | Self::BirchfieldTomasi => self.max_cost() / 2,
            Self::Census16 => 6,
            Self::Census32 => 12,
        }
    }

    /// The smoothness costs of its edges.
    fn edges(self) -> EdgeLevels {
        let uniform = |slope, truncation| EdgeLevels::uniform(Smoothness { slope, truncation });
        match self {
            Self::Thesis => uniform(10, 17),
            Self::Census => uniform(2, 10),
            Self::Mrf => uniform(20, 40),
            Self::Gradient => uniform(7, 50),
            Self::BirchfieldTomasi => uniform(10, 60),
            Self::Census16 => EdgeLevels::by_grey([(3, 22), (2, 15), (2, 10), (1, 5)]),
            Self::Census32 => EdgeLevels::by_grey([(6, 40), (4, 28), (3, 18), (2, 10)]),
        }
    }
}

/// The labels, and the energy that matching minimises:
/// `E(f) = sum_p D(p, f_p) + sum_(p,q) min(s |f_p - f_q|, K)` over the pixels p and the 4-neighbour pairs (p, q). The slope s and
/// the truncation K are those of the edge's level; see [`EdgeLevels`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Model {
    profile: Profile,
    labels: u16,
    min_disparity: i32,
    edges: EdgeLevels,
}

impl Model {
    /// A model with this many labels and the smoothness of its profile. Label i is a disparity of i pixels.
    ///
    /// # Errors
    /// [`Error::Labels`] if `labels` is 0 or above [`MAX_LABELS`].
    pub fn new(profile: Profile, labels: usize) -> Result<Self, Error> {
        if labels == 0 || labels > MAX_LABELS {
            return Err(Error::Labels { labels });
        }
        Ok(Self { profile, labels: labels as u16, min_disparity: 0, edges: profile.edges() })
    }

    /// The same model, but label i is a disparity of `min_disparity + i` pixels.
    ///
    /// # Errors
    /// [`Error::MinDisparity`] if its absolute value exceeds [`MAX_SIDE`].
    pub fn with_min_disparity(self, min_disparity: i32) -> Result<Self, Error> {
        if min_disparity.unsigned_abs() as usize > MAX_SIDE {
            return Err(Error::MinDisparity { min_disparity });
        }
        Ok(Self { min_disparity, ..self })
    }

    /// The same model with one slope s and truncation K for all edges, in the units of the profile's data cost.
    ///
    /// # Errors
    /// [`Error::Truncation`] if K exceeds [`MAX_TRUNCATION`].
    pub fn with_smoothness(self, slope: u8, truncation: u8) -> Result<Self, Error> {
        if truncation > MAX_TRUNCATION {
            return Err(Error::Truncation { truncation });
        }
        Ok(self.with_edges(EdgeLevels::uniform(Smoothness { slope, truncation })))
    }

    /// The same model with other smoothness costs. Every grid uses its own grey values to find the level of an edge; see
    /// [`Model::coarse_grey`].
    #[must_use]
    pub fn with_edges(self, edges: EdgeLevels) -> Self {
        Self { edges, ..self }
    }

    /// The same model with two levels of edges: where grey values differ by more than `threshold`, slope and truncation are half
    /// of those of the first level, rounded down.
    #[must_use]
    pub fn with_edges_halved_above(self, threshold: u8) -> Self {
        self.with_edges(EdgeLevels::halved_above(threshold, self.smoothness()))
    }

    /// The data cost profile.
    #[must_use]
    pub fn profile(&self) -> Profile {
        self.profile
    }

    /// Number of labels (L).
    #[must_use]
    pub fn labels(&self) -> usize {
        usize::from(self.labels)
    }

    /// The disparity of label 0 in pixels.
    #[must_use]
    pub fn min_disparity(&self) -> i32 {
        self.min_disparity
    }

    /// The disparity of a label in pixels.
    #[must_use]
    pub fn disparity(&self, label: u16) -> i32 {
        self.min_disparity + i32::from(label)
    }

    /// The smoothness costs by level.
    #[must_use]
    pub fn edges(&self) -> &EdgeLevels {
        &self.edges
    }

    /// The smoothness cost of the first level: no other has a greater slope or truncation.
    #[must_use]
    pub fn smoothness(&self) -> Smoothness {
        self.edges.usual()
    }

    /// Slope s of the first level.
    #[must_use]
    pub fn slope(&self) -> u8 {
        self.smoothness().slope
    }

    /// Truncation K of the first level.
    #[must_use]
    pub fn truncation(&self) -> u8 {
        self.smoothness().truncation
    }

    /// The smoothness cost of an edge between nodes of these grey values.
    #[must_use]
    pub fn smoothness_between(&self, a: u8, b: u8) -> Smoothness {
        self.edges.smoothness()[self.edges.level(a.abs_diff(b))]
    }

    /// The grey value of a node of a coarser grid: the mean of its `count` children's grey values, whose sum is `sum`,
    /// rounded as `(sum + count div 2) div count`.
    ///
    /// # Panics
    /// If `count` is 0.
    #[must_use]
    pub fn coarse_grey(sum: u16, count: u16) -> u8 {
        ((sum + count / 2) / count) as u8
    }

    /// The value `4K + 1` at which stored data costs are clipped. No label with such a cost is ever chosen. See also
    /// [`crate::Plan::clip`].
    #[must_use]
    pub fn clip(&self) -> u8 {
        4 * self.truncation() + 1
    }

    /// The largest data cost on `grid`, where a node sums up to `4^grid` pixels.
    #[must_use]
    pub fn max_cost(&self, grid: usize) -> u64 {
        u64::from(self.profile.max_cost()) << (2 * grid)
    }

    /// The column of the right image that column `x` of the left image matches under `label`, if it lies in an image
    /// `width` pixels wide.
    #[must_use]
    #[inline(always)]
    pub fn matching_column(&self, x: usize, label: u16, width: usize) -> Option<usize> {
        let column = x as i64 - i64::from(self.disparity(label));
        usize::try_from(column).ok().filter(|&column| column < width)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_enforced() {
        assert_eq!(Model::new(Profile::Thesis, 0), Err(Error::Labels { labels: 0 }));
        assert!(Model::new(Profile::Thesis, 512).is_ok());
        assert!(Model::new(Profile::Thesis, MAX_LABELS + 1).is_err());
        let model = Model::new(Profile::Mrf, 4).unwrap();
        assert!(model.with_smoothness(1, 63).is_ok());
        assert_eq!(model.with_smoothness(1, 64), Err(Error::Truncation { truncation: 64 }));
        assert!(model.with_min_disparity(i32::MIN).is_err());
    }

    #[test]
    fn grey_values_choose_the_smoothness() {
        let usual = Smoothness { slope: 3, truncation: 11 };
        let model = Model::new(Profile::Census, 4).unwrap().with_edges(EdgeLevels::halved_above(10, usual));
        let weak = Smoothness { slope: 1, truncation: 5 };
        assert_eq!([(50, 60), (60, 50)].map(|(a, b)| model.smoothness_between(a, b)), [usual; 2]);
        assert_eq!([(50, 61), (61, 50)].map(|(a, b)| model.smoothness_between(a, b)), [weak; 2]);
        let uniform = model.with_smoothness(3, 11).unwrap();
        assert_eq!(uniform.smoothness_between(0, 255), usual);
        assert_eq!((weak.of(2, 9), weak.of(9, 6), weak.step()), (5, 3, 1));
        assert_eq!([(3, 2), (5, 4), (6, 4), (1020, 4)].map(|(sum, n)| Model::coarse_grey(sum, n)), [2, 1, 2, 255]);
    }

    #[test]
    fn the_profiles_own_levels_are_valid() {
        for edges in Profile::ALL.map(Profile::edges) {
            let [first, second, third, last] = std::array::from_fn(|i| (edges.most()[i], edges.smoothness()[i]));
            assert_eq!(EdgeLevels::new([first, second, third, last]), Ok(edges));
        }
    }

    #[test]
    fn columns_outside_the_right_image_match_nothing() {
        let model = Model::new(Profile::Thesis, 4).unwrap().with_min_disparity(-2).unwrap();
        let columns: Vec<_> = (0..4).map(|label| model.matching_column(1, label, 3)).collect();
        assert_eq!(columns, [None, Some(2), Some(1), Some(0)]);
        assert_eq!(model.matching_column(0, 3, 3), None);
    }
}
