//! Nodes of a grid.

/// A node of a grid, by its column and row. The nodes of grid 0 are the pixels of the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Node {
    /// The column.
    pub x: usize,
    /// The row.
    pub y: usize,
}

impl Node {
    /// The node of the next coarser grid that covers this one.
    #[must_use]
    pub fn parent(self) -> Self {
        Self { x: self.x / 2, y: self.y / 2 }
    }

    /// Whether the node has the first colour of the checkerboard.
    #[must_use]
    pub fn is_even(self) -> bool {
        (self.x + self.y).is_multiple_of(2)
    }
}
