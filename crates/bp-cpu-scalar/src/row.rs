//! The nodes of a row by checkerboard colour.

use bp_core::{Node, Size};

/// A colour of the checkerboard.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Parity {
    /// Nodes whose x + y is even.
    Even,
    /// Nodes whose x + y is odd.
    Odd,
}

/// The nodes of one colour in row y.
pub(crate) fn row_nodes(size: Size, y: usize, parity: Parity) -> impl Iterator<Item = Node> {
    ((y + parity as usize) % 2..size.width).step_by(2).map(move |x| Node { x, y })
}
