//! The smoothness cost: the penalty for different labels at two neighbours.

use crate::{Error, limits::MAX_TRUNCATION};

/// The smoothness cost of an edge: `min(slope |a - b|, truncation)` for the labels a and b of its two nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Smoothness {
    /// Slope s.
    pub slope: u8,
    /// Truncation K.
    pub truncation: u8,
}

impl Smoothness {
    /// The cost V(a, b) of two labels.
    #[must_use]
    pub fn of(self, a: u16, b: u16) -> u32 {
        (u32::from(self.slope) * u32::from(a.abs_diff(b))).min(u32::from(self.truncation))
    }

    /// The cost of one step between neighbouring labels, `min(s, K)`, which the two passes of a message update add.
    #[must_use]
    pub fn step(self) -> u8 {
        self.slope.min(self.truncation)
    }
}

/// The smoothness costs of edges by *level*. The level of an edge is determined by how much the grey values of its two
/// nodes in the left image differ: labels may differ more cheaply where the image changes, because surfaces tend to end there
/// (after Boykov, Veksler and Zabih 2001).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct EdgeLevels {
    most: [u8; Self::COUNT],
    smoothness: [Smoothness; Self::COUNT],
}

impl EdgeLevels {
    /// The number of levels.
    pub const COUNT: usize = 4;

    /// The same cost for all edges.
    pub(crate) const fn uniform(smoothness: Smoothness) -> Self {
        Self { most: [u8::MAX; Self::COUNT], smoothness: [smoothness; Self::COUNT] }
    }

    /// Two levels: above a difference of `threshold`, slope and truncation are halved, rounded down.
    pub(crate) const fn halved_above(threshold: u8, usual: Smoothness) -> Self {
        let weak = Smoothness { slope: usual.slope / 2, truncation: usual.truncation / 2 };
        Self { most: [threshold, u8::MAX, u8::MAX, u8::MAX], smoothness: [usual, weak, weak, weak] }
    }

    /// The levels of our census profiles: slopes and truncations for differences up to 3, 8 and 20, and more.
    pub(crate) fn by_grey(costs: [(u8, u8); Self::COUNT]) -> Self {
        let smoothness = costs.map(|(slope, truncation)| Smoothness { slope, truncation });
        Self { most: [3, 8, 20, u8::MAX], smoothness }
    }

    /// Levels from differences and costs: an edge has the first level whose difference is at least its own.
    ///
    /// # Errors
    /// [`Error::EdgeLevels`] if the differences do not ascend to 255, or a slope or truncation is greater than at the level
    /// before. [`Error::Truncation`] if a truncation exceeds [`MAX_TRUNCATION`].
    pub fn new(levels: [(u8, Smoothness); Self::COUNT]) -> Result<Self, Error> {
        let edges = Self { most: levels.map(|(most, _)| most), smoothness: levels.map(|(_, smoothness)| smoothness) };
        let truncation = edges.usual().truncation;
        if truncation > MAX_TRUNCATION {
            return Err(Error::Truncation { truncation });
        }
        let falls = |by: fn(&Smoothness) -> u8| edges.smoothness.iter().map(by).rev().is_sorted();
        let descend = falls(|level| level.slope) && falls(|level| level.truncation);
        let is_valid = descend && edges.most.is_sorted() && edges.most.ends_with(&[u8::MAX]);
        if is_valid { Ok(edges) } else { Err(Error::EdgeLevels) }
    }

    /// The level of an edge whose nodes' grey values differ by this.
    #[must_use]
    pub fn level(&self, difference: u8) -> usize {
        self.most.iter().filter(|&&most| difference > most).count()
    }

    /// The greatest difference of each level. They ascend to 255.
    #[must_use]
    pub fn most(&self) -> [u8; Self::COUNT] {
        self.most
    }

    /// The smoothness cost of each level. Slope and truncation never rise from level to level.
    #[must_use]
    pub fn smoothness(&self) -> [Smoothness; Self::COUNT] {
        self.smoothness
    }

    /// The smoothness cost of the first level, which has the largest slope and truncation.
    #[must_use]
    pub fn usual(&self) -> Smoothness {
        self.smoothness[0]
    }

    /// Whether all edges have the same cost.
    #[must_use]
    pub fn is_uniform(&self) -> bool {
        self.most[0] == u8::MAX || self.smoothness.iter().all(|level| *level == self.usual())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn of(slope: u8, truncation: u8) -> Smoothness {
        Smoothness { slope, truncation }
    }

    #[test]
    fn an_edge_has_the_first_level_that_holds_its_difference() {
        let levels = [(3, of(3, 22)), (8, of(2, 15)), (8, of(2, 10)), (255, of(1, 5))];
        let edges = EdgeLevels::new(levels).unwrap();
        assert_eq!([0, 3, 4, 8, 9, 255].map(|difference| edges.level(difference)), [0, 0, 1, 1, 3, 3]);
        assert!(!edges.is_uniform() && EdgeLevels::uniform(of(2, 10)).is_uniform());
    }

    #[test]
    fn levels_ascend_in_difference_and_descend_in_cost() {
        let with = |levels: [(u8, Smoothness); 4]| EdgeLevels::new(levels).unwrap_err();
        assert_eq!(with([(9, of(1, 1)), (8, of(1, 1)), (9, of(1, 1)), (255, of(1, 1))]), Error::EdgeLevels);
        assert_eq!(with([(1, of(1, 1)), (2, of(1, 1)), (3, of(1, 1)), (254, of(1, 1))]), Error::EdgeLevels);
        assert_eq!(with([(1, of(1, 9)), (2, of(2, 8)), (3, of(1, 7)), (255, of(1, 6))]), Error::EdgeLevels);
        assert_eq!(with([(1, of(4, 5)), (2, of(3, 6)), (3, of(2, 4)), (255, of(1, 3))]), Error::EdgeLevels);
        let too_much = [(1, of(1, 64)), (2, of(1, 1)), (3, of(1, 1)), (255, of(1, 1))];
        assert_eq!(with(too_much), Error::Truncation { truncation: 64 });
    }
}
