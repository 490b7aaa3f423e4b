//! The kernels. Each has its own WGSL file.

use std::fmt;

/// The invocations of a workgroup, if labels are not shared out. The WGSL files contain the same number.
pub const WORKGROUP: u32 = 64;

/// What a kernel does with a buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Access {
    /// Reads it.
    Read,
    /// Writes it, and may read what it wrote.
    Write,
}

use Access::{Read, Write};

/// A kernel, named like its file and its entry point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kernel {
    /// The features that the profile compares, for every pixel of one image; part of the stage `match_cost`.
    Features,
    /// Grey values of the left image, if the model has edges of several levels; part of the stage `match_cost`.
    Greys,
    /// Steps and truncations of the edges of a grid, if the model has edges of several levels; part of the stages `match_cost` and
    /// `coarsen`.
    EdgeCosts,
    /// Data costs of the image.
    MatchCost,
    /// Grey values of a coarser grid, if the model has edges of several levels; part of the stage `coarsen`.
    CoarsenGreys,
    /// Data costs of a coarser grid.
    Coarsen,
    /// First messages of a grid.
    Refine,
    /// Message passing, four nodes an invocation.
    UpdateMessages,
    /// Message passing, a slice of labels an invocation; part of the stage `update_messages`.
    UpdateMessagesOfSlice,
    /// Message passing through rows of bands, a segment a workgroup; part of the stages `refine` and `update_messages`.
    PassRows,
    /// Labels.
    SelectLabels,
    /// Labels of rows of bands, a segment a workgroup; part of the stages `refine`, `update_messages` and `select_labels`.
    DecideRows,
    /// The label sets of a grid.
    LabelSets,
    /// The data costs of label sets.
    RestrictCosts,
    /// Messages with values for all labels, from those of label sets.
    ExtendMessages,
    /// A copy of a buffer, to measure the rate of copying; part of no plan.
    Copy,
}

impl Kernel {
    /// All kernels.
    pub const ALL: [Self; 16] = [
        Self::Features,
        Self::Greys,
        Self::EdgeCosts,
        Self::MatchCost,
        Self::CoarsenGreys,
        Self::Coarsen,
        Self::Refine,
        Self::UpdateMessages,
        Self::UpdateMessagesOfSlice,
        Self::PassRows,
        Self::SelectLabels,
        Self::DecideRows,
        Self::LabelSets,
        Self::RestrictCosts,
        Self::ExtendMessages,
        Self::Copy,
    ];

    /// The name of the kernel, of its file and of its entry point.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Features => "features",
            Self::Greys => "greys",
            Self::EdgeCosts => "edge_costs",
            Self::MatchCost => "match_cost",
            Self::CoarsenGreys => "coarsen_greys",
            Self::Coarsen => "coarsen",
            Self::Refine => "refine",
            Self::UpdateMessages => "update_messages",
            Self::UpdateMessagesOfSlice => "update_messages_of_slice",
            Self::PassRows => "pass_rows",
            Self::SelectLabels => "select_labels",
            Self::DecideRows => "decide_rows",
            Self::LabelSets => "label_sets",
            Self::RestrictCosts => "restrict_costs",
            Self::ExtendMessages => "extend_messages",
            Self::Copy => "copy",
        }
    }

    /// The complete WGSL text: the part that all kernels share, the parts that some share, then the kernel's own.
    #[must_use]
    pub fn source(self) -> String {
        let own = match self {
            Self::Features => bp_shaders::FEATURES,
            Self::Greys => bp_shaders::GREYS,
            Self::EdgeCosts => bp_shaders::EDGE_COSTS,
            Self::MatchCost => bp_shaders::MATCH_COST,
            Self::CoarsenGreys => bp_shaders::COARSEN_GREYS,
            Self::Coarsen => bp_shaders::COARSEN,
            Self::Refine => bp_shaders::REFINE,
            Self::UpdateMessages => bp_shaders::UPDATE_MESSAGES,
            Self::UpdateMessagesOfSlice => bp_shaders::UPDATE_MESSAGES_OF_SLICE,
            Self::PassRows => bp_shaders::PASS_ROWS,
            Self::SelectLabels => bp_shaders::SELECT_LABELS,
            Self::DecideRows => bp_shaders::DECIDE_ROWS,
            Self::LabelSets => bp_shaders::LABEL_SETS,
            Self::RestrictCosts => bp_shaders::RESTRICT_COSTS,
            Self::ExtendMessages => bp_shaders::EXTEND_MESSAGES,
            Self::Copy => bp_shaders::COPY,
        };
        let of_several: &[&str] = match self {
            Self::Features | Self::Greys => &[bp_shaders::IMAGE],
            Self::MatchCost | Self::Coarsen => &[bp_shaders::SLICES, bp_shaders::COSTS],
            Self::UpdateMessages => &[bp_shaders::MESSAGES, bp_shaders::EDGE_LEVELS],
            Self::EdgeCosts => &[bp_shaders::EDGE_LEVELS],
            Self::UpdateMessagesOfSlice => &[bp_shaders::SLICES, bp_shaders::MESSAGES, bp_shaders::ENVELOPE],
            Self::PassRows => &[bp_shaders::SLICES, bp_shaders::ENVELOPE, bp_shaders::SEGMENTS],
            Self::SelectLabels => {
                &[bp_shaders::SLICES, bp_shaders::MESSAGES, bp_shaders::EDGE_LEVELS, bp_shaders::DECISIONS]
            }
            Self::DecideRows => {
                &[bp_shaders::SLICES, bp_shaders::EDGE_LEVELS, bp_shaders::DECISIONS, bp_shaders::SEGMENTS]
            }
            Self::CoarsenGreys | Self::Copy => &[],
            Self::Refine => &[bp_shaders::SLICES],
            Self::RestrictCosts => &[bp_shaders::SLICES, bp_shaders::SETS],
            Self::LabelSets | Self::ExtendMessages => &[bp_shaders::SETS],
        };
        [bp_shaders::SHARED, &of_several.concat(), own].concat()
    }

    /// How it accesses the storage buffers of group 0, from binding 1 on. Binding 0 is a read-only block of parameters
    /// at a dynamic offset.
    #[must_use]
    pub fn bindings(self) -> &'static [Access] {
        match self {
            Self::Features | Self::Greys | Self::CoarsenGreys => &[Read, Write],
            Self::EdgeCosts | Self::LabelSets | Self::ExtendMessages | Self::Copy => &[Write, Read],
            Self::MatchCost => &[Write, Write, Read, Read, Read],
            Self::Coarsen => &[Write, Write, Read, Read, Read, Read],
            Self::Refine | Self::RestrictCosts => &[Write, Read, Read],
            Self::UpdateMessages | Self::UpdateMessagesOfSlice => {
                &[Read, Read, Read, Read, Read, Write, Write, Write, Write, Read]
            }
            Self::PassRows => &[Read, Read, Read, Read, Read, Write, Write, Write, Write, Write, Read],
            Self::SelectLabels => &[Read, Read, Read, Read, Read, Write, Read],
            Self::DecideRows => &[Read, Read, Read, Read, Read, Read, Write, Write, Read],
        }
    }

    /// Whether a pipeline's constants say how many words of nodes and slices of labels a workgroup has. The others have
    /// [`WORKGROUP`] invocations.
    #[must_use]
    pub fn is_sliced(self) -> bool {
        match self {
            Self::MatchCost
            | Self::Coarsen
            | Self::Refine
            | Self::UpdateMessagesOfSlice
            | Self::PassRows
            | Self::SelectLabels
            | Self::DecideRows
            | Self::RestrictCosts => true,
            Self::Features
            | Self::Greys
            | Self::CoarsenGreys
            | Self::EdgeCosts
            | Self::UpdateMessages
            | Self::LabelSets
            | Self::ExtendMessages
            | Self::Copy => false,
        }
    }

    /// Whether each of its workgroups has a segment of a band, whose rows it goes through one after another.
    #[must_use]
    pub fn has_segments(self) -> bool {
        matches!(self, Self::PassRows | Self::DecideRows)
    }

    /// The most storage buffers that a kernel binds, including the parameters.
    #[must_use]
    pub fn most_bindings() -> u32 {
        Self::ALL.iter().map(|kernel| 1 + kernel.bindings().len() as u32).max().unwrap_or(0)
    }
}

/// A kernel with the values of its pipeline-overridable constants, compiled as one unit.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Pipeline {
    /// The kernel.
    pub kernel: Kernel,
    /// The name and value of each constant that its WGSL text declares with `override`.
    pub constants: Vec<(&'static str, u32)>,
}

impl fmt::Display for Pipeline {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.kernel.name())?;
        self.constants.iter().try_for_each(|(name, value)| write!(f, " {name}={value}"))
    }
}
