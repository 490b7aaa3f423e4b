//! The smoothness cost: the penalty for different labels at two neighbours.

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

    /// The smoothness of a weak edge: slope and truncation are halved, rounded down; see [`crate::Model::with_weak_edges`].
    #[must_use]
    pub fn weakened(self) -> Self {
        Self { slope: self.slope / 2, truncation: self.truncation / 2 }
    }
}
