//! The four neighbours of a node.

/// Where a neighbour lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Side {
    /// (x - 1, y).
    Left,
    /// (x + 1, y).
    Right,
    /// (x, y - 1).
    Up,
    /// (x, y + 1).
    Down,
}

impl Side {
    /// All sides, in the order in which messages are stored and hashed.
    pub const ALL: [Self; 4] = [Self::Left, Self::Right, Self::Up, Self::Down];

    /// The side seen from the neighbour.
    #[must_use]
    pub fn opposite(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
            Self::Up => Self::Down,
            Self::Down => Self::Up,
        }
    }
}
