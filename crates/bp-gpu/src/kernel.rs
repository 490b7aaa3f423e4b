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
    /// Labels.
    SelectLabels,
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
    pub const ALL: [Self; 13] = [
        Self::Features,
        Self::Greys,
        Self::MatchCost,
        Self::CoarsenGreys,
        Self::Coarsen,
        Self::Refine,
        Self::UpdateMessages,
        Self::UpdateMessagesOfSlice,
        Self::SelectLabels,
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
            Self::MatchCost => "match_cost",
            Self::CoarsenGreys => "coarsen_greys",
            Self::Coarsen => "coarsen",
            Self::Refine => "refine",
            Self::UpdateMessages => "update_messages",
            Self::UpdateMessagesOfSlice => "update_messages_of_slice",
            Self::SelectLabels => "select_labels",
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
            Self::MatchCost => bp_shaders::MATCH_COST,
            Self::CoarsenGreys => bp_shaders::COARSEN_GREYS,
            Self::Coarsen => bp_shaders::COARSEN,
            Self::Refine => bp_shaders::REFINE,
            Self::UpdateMessages => bp_shaders::UPDATE_MESSAGES,
            Self::UpdateMessagesOfSlice => bp_shaders::UPDATE_MESSAGES_OF_SLICE,
            Self::SelectLabels => bp_shaders::SELECT_LABELS,
            Self::LabelSets => bp_shaders::LABEL_SETS,
            Self::RestrictCosts => bp_shaders::RESTRICT_COSTS,
            Self::ExtendMessages => bp_shaders::EXTEND_MESSAGES,
            Self::Copy => bp_shaders::COPY,
        };
        let of_several: &[&str] = match self {
            Self::Features | Self::Greys => &[bp_shaders::IMAGE],
            Self::MatchCost | Self::Coarsen => &[bp_shaders::SLICES, bp_shaders::COSTS],
            Self::UpdateMessages => &[bp_shaders::MESSAGES, bp_shaders::EDGE_LEVELS],
            Self::UpdateMessagesOfSlice | Self::SelectLabels => {
                &[bp_shaders::SLICES, bp_shaders::MESSAGES, bp_shaders::EDGE_LEVELS]
            }
            Self::CoarsenGreys | Self::Copy => &[],
            Self::Refine => &[bp_shaders::SLICES],
            Self::LabelSets | Self::RestrictCosts | Self::ExtendMessages => &[bp_shaders::SETS],
        };
        [bp_shaders::SHARED, &of_several.concat(), own].concat()
    }

    /// How it accesses the storage buffers of group 0, from binding 1 on. Binding 0 is a read-only block of parameters
    /// at a dynamic offset.
    #[must_use]
    pub fn bindings(self) -> &'static [Access] {
        match self {
            Self::Features | Self::Greys | Self::CoarsenGreys => &[Read, Write],
            Self::LabelSets | Self::ExtendMessages | Self::Copy => &[Write, Read],
            Self::MatchCost => &[Write, Write, Read, Read, Read],
            Self::Coarsen => &[Write, Write, Read, Read, Read, Read],
            Self::Refine | Self::RestrictCosts => &[Write, Read, Read],
            Self::UpdateMessages | Self::UpdateMessagesOfSlice => {
                &[Read, Read, Read, Read, Read, Write, Write, Write, Write, Read]
            }
            Self::SelectLabels => &[Read, Read, Read, Read, Read, Write, Read],
        }
    }

    /// Whether a pipeline's constants say how many words of nodes and slices of labels a workgroup has. The others have
    /// [`WORKGROUP`] invocations.
    #[must_use]
    pub fn is_sliced(self) -> bool {
        match self {
            Self::MatchCost | Self::Coarsen | Self::Refine | Self::UpdateMessagesOfSlice | Self::SelectLabels => true,
            Self::Features
            | Self::Greys
            | Self::CoarsenGreys
            | Self::UpdateMessages
            | Self::LabelSets
            | Self::RestrictCosts
            | Self::ExtendMessages
            | Self::Copy => false,
        }
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
