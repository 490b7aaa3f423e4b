//! The parameters of a dispatch.

use bp_core::EdgeLevels;
use bytemuck::{Pod, Zeroable};

/// Declares the struct, and a list of its fields that a test compares with the WGSL struct.
macro_rules! parameters {
    ($($(#[$doc:meta])* $field:ident: $type:ty,)*) => {
        /// The parameters of a dispatch. `shared.wgsl` has a struct of the same name.
        #[repr(C)]
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Pod, Zeroable)]
        pub struct Parameters {
            $($(#[$doc])* pub $field: $type,)*
        }

        impl Parameters {
            /// The names and byte offsets of the fields, in order.
            pub const FIELDS: &[(&str, usize)] =
                &[$((stringify!($field), std::mem::offset_of!(Parameters, $field)),)*];
        }
    };
}

parameters! {
    /// Columns of the grid.
    width: u32,
    /// Rows of the grid.
    height: u32,
    /// Words in a row of a plane.
    words: u32,
    /// Labels.
    labels: u32,
    /// Quads of labels.
    quads: u32,
    /// First row of the strip, in the grid.
    first_row: u32,
    /// Colour of the nodes.
    colour: u32,
    /// First row of the dispatch, in the strip.
    row: u32,
    /// Distance between its rows.
    row_step: u32,
    /// Number of its rows, or of bands in `pass_rows` and `decide_rows`.
    rows: u32,
    /// Of how many rows each is the first.
    span: u32,
    /// Rows of the strip.
    strip_rows: u32,
    /// Slope of the smoothness cost by level of edges.
    slopes: [u32; EdgeLevels::COUNT],
    /// Truncation of the smoothness cost by level.
    truncations: [u32; EdgeLevels::COUNT],
    /// The smaller of the two by level.
    steps: [u32; EdgeLevels::COUNT],
    /// The greatest grey difference of each level.
    most: [u32; EdgeLevels::COUNT],
    /// The value at which data costs are clipped.
    clip: u32,
    /// Disparity of label 0.
    min_disparity: i32,
    /// Data cost of the labels that fill the last quad.
    padding_cost: u32,
    /// First column right of the cut, or 0.
    cut_x: u32,
    /// First row below the cut, or 0.
    cut_y: u32,
    /// The sides to send to, one bit each.
    sends: u32,
    /// 1 if the rows above have labels, under the schedule `sweep`.
    labels_above: u32,
    /// 1 if label sets or labels are those of seams, 0 if they are those of bands.
    seams: u32,
    /// The first segment of the dispatch.
    first_segment: u32,
    /// The words that a segment keeps.
    kept_words: u32,
    /// 1 if a pass goes up.
    backward: u32,
    /// 1 if the last row of a pass sends ahead too.
    across: u32,
    /// How many labels an offer may pass before it costs as much as the truncation.
    reach: u32,
    /// The one side whose messages are refined or extended.
    side: u32,
    /// Columns of the grid that is read.
    other_width: u32,
    /// Its rows.
    other_height: u32,
    /// Words in a row of its planes.
    other_words: u32,
    /// First row of its strip, in that grid.
    other_first_row: u32,
}
