//! The WGSL text of the GPU kernels.
//!
//! Each kernel has its own file, named after it. Several kernels share some of the files; `bp_gpu::Kernel::source`
//! assembles the parts of a kernel.

macro_rules! wgsl {
    ($($(#[$doc:meta])* $name:ident = $file:literal;)*) => {
        $($(#[$doc])* pub const $name: &str = include_str!(concat!("../", $file));)*
    };
}

// The kernels.
wgsl! {
    /// Computes the features that the profile compares, for every pixel of one image.
    FEATURES = "features.wgsl";
    /// Computes the grey values of the left image.
    GREYS = "greys.wgsl";
    /// Finds the costs of the edges of a grid.
    EDGE_COSTS = "edge_costs.wgsl";
    /// Computes the data costs of the image.
    MATCH_COST = "match_cost.wgsl";
    /// Computes the grey values of a coarser grid.
    COARSEN_GREYS = "coarsen_greys.wgsl";
    /// Computes the data costs of a coarser grid.
    COARSEN = "coarsen.wgsl";
    /// Computes the first messages of a grid.
    REFINE = "refine.wgsl";
    /// Updates messages.
    UPDATE_MESSAGES = "update_messages.wgsl";
    /// Updates messages, a slice of labels an invocation.
    UPDATE_MESSAGES_OF_SLICE = "update_messages_of_slice.wgsl";
    /// Passes messages through rows of bands.
    PASS_ROWS = "pass_rows.wgsl";
    /// Decides the labels of rows of bands.
    DECIDE_ROWS = "decide_rows.wgsl";
    /// Selects labels.
    SELECT_LABELS = "select_labels.wgsl";
    /// Finds the label sets of a grid.
    LABEL_SETS = "label_sets.wgsl";
    /// Computes the data costs of label sets.
    RESTRICT_COSTS = "restrict_costs.wgsl";
    /// Extends messages from label sets to all labels.
    EXTEND_MESSAGES = "extend_messages.wgsl";
    /// Copies a buffer.
    COPY = "copy.wgsl";
}

// Shared by several kernels.
wgsl! {
    /// The parameters and helpers of all kernels.
    SHARED = "shared.wgsl";
    /// Shares out the labels of nodes among invocations.
    SLICES = "slices.wgsl";
    /// Reads the pixels of an image.
    IMAGE = "image.wgsl";
    /// Writes data costs.
    COSTS = "costs.wgsl";
    /// Reads data costs and messages.
    MESSAGES = "messages.wgsl";
    /// Computes the message of a slice of labels.
    ENVELOPE = "envelope.wgsl";
    /// Finds the smoothness costs beside decided labels.
    DECISIONS = "decisions.wgsl";
    /// The segments of bands.
    SEGMENTS = "segments.wgsl";
    /// The layout of label sets.
    SETS = "sets.wgsl";
    /// Finds the levels of edges.
    EDGE_LEVELS = "edge_levels.wgsl";
}
