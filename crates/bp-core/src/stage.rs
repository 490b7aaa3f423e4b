//! The stages of a solve.

/// A timed stage: the kernel of the same name, over all grids.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Stage {
    /// Data costs of the image.
    MatchCost,
    /// Data costs of the coarser grids.
    Coarsen,
    /// First messages of every grid, and the seams of [`crate::Schedule::Sweep`]. A backend may do this while it updates messages.
    Refine,
    /// Message passing.
    UpdateMessages,
    /// Label selection.
    SelectLabels,
}

impl Stage {
    /// All stages, in the order in which they first run.
    pub const ALL: [Self; 5] = [Self::MatchCost, Self::Coarsen, Self::Refine, Self::UpdateMessages, Self::SelectLabels];

    /// The name of the stage, and of its kernel.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::MatchCost => "match_cost",
            Self::Coarsen => "coarsen",
            Self::Refine => "refine",
            Self::UpdateMessages => "update_messages",
            Self::SelectLabels => "select_labels",
        }
    }
}
