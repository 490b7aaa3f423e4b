//! Sizes of images and grids.

use std::fmt;

use crate::Node;

/// Width and height of an image or grid in pixels; both at least 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Size {
    /// Pixels per row (m).
    pub width: usize,
    /// Pixels per column (n).
    pub height: usize,
}

impl Size {
    /// Number of pixels.
    #[must_use]
    pub fn pixels(self) -> usize {
        self.width * self.height
    }

    /// The index of a node in row order.
    #[must_use]
    pub fn index(self, node: Node) -> usize {
        node.y * self.width + node.x
    }

    /// All nodes in row order.
    pub fn nodes(self) -> impl Iterator<Item = Node> + use<> {
        (0..self.height).flat_map(move |y| (0..self.width).map(move |x| Node { x, y }))
    }

    /// The next coarser grid: half the width and height, rounded up.
    #[must_use]
    pub fn coarser(self) -> Self {
        Self { width: self.width.div_ceil(2), height: self.height.div_ceil(2) }
    }
}

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.width, self.height)
    }
}
