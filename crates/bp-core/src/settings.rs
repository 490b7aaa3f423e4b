//! The settings of a plan, and the algorithms as ways to fill them.

use crate::{Node, Size};

/// The algorithms of Doan Van Tuan's thesis (2019), and one of ours. Each is a way to fill [`Settings`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Algorithm {
    /// Plain belief propagation (BP): k loops on the full grid.
    Bp,
    /// Coarse-to-fine BP: `floor(log2 m)` grids with `floor(k / (floor(log2 m) + 1))` loops on each.
    Cfbp,
    /// Coarse-to-fine constant-space BP: coarse-to-fine BP with Z'' times fewer loops.
    Cfcsbp,
    /// Census-transform BP: four parts, cut at the centre of the image, whose match the census transform finds.
    Ctbp,
    /// Census-transform constant-space BP: census-transform BP with Z'''' times fewer loops.
    Ctcsbp,
    /// Ours: coarse to fine on five grids with one loop of [`Schedule::Sweep`] on each.
    Sweep,
}

impl Algorithm {
    /// The algorithms of the thesis, in its order.
    pub const THESIS: [Self; 5] = [Self::Bp, Self::Cfbp, Self::Cfcsbp, Self::Ctbp, Self::Ctcsbp];

    /// All algorithms: first those of the thesis, then ours.
    pub const ALL: [Self; 6] = [Self::Bp, Self::Cfbp, Self::Cfcsbp, Self::Ctbp, Self::Ctcsbp, Self::Sweep];

    /// The name used in options and records.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Bp => "bp",
            Self::Cfbp => "cfbp",
            Self::Cfcsbp => "cfcsbp",
            Self::Ctbp => "ctbp",
            Self::Ctcsbp => "ctcsbp",
            Self::Sweep => "sweep",
        }
    }

    /// Whether the loops are divided by a "coefficient of depth change" Z.
    #[must_use]
    pub fn divides_loops(self) -> bool {
        matches!(self, Self::Cfcsbp | Self::Ctcsbp)
    }

    /// Whether it runs on several grids.
    #[must_use]
    pub fn is_coarse_to_fine(self) -> bool {
        matches!(self, Self::Cfbp | Self::Cfcsbp | Self::Sweep)
    }

    /// Whether it cuts the image into four parts.
    #[must_use]
    pub fn is_cut(self) -> bool {
        matches!(self, Self::Ctbp | Self::Ctcsbp)
    }

    /// The settings of the thesis for an image of `size`: `k` loops in all (equations 2.37, 2.38, 2.50 and 2.71), divided
    /// by `z` if the algorithm divides. Under [`Schedule::Checkerboard`] a loop is two half-steps. No count falls below 1.
    /// [`Algorithm::Sweep`] has its own settings, which depend only on the size.
    #[must_use]
    pub fn settings(self, size: Size, k: u32, z: u32, schedule: Schedule) -> Settings {
        let log2 = size.width.max(1).ilog2();
        if self == Self::Sweep {
            return Settings {
                grids: log2.clamp(1, 5),
                steps: 1,
                schedule: Schedule::Sweep,
                message_start: MessageStart::Receiver,
                cut: None,
                coarse_clip: true,
                label_sets: false,
            };
        }
        let levels = if self.is_coarse_to_fine() { log2 + 1 } else { 1 };
        let z = if self.divides_loops() { z.max(1) } else { 1 };
        let loops = (k / (z.saturating_mul(levels))).max(1);
        Settings {
            grids: if self.is_coarse_to_fine() { log2.max(1) } else { 1 },
            steps: loops.saturating_mul(schedule.steps_per_loop()),
            schedule,
            message_start: MessageStart::Receiver,
            cut: self.is_cut().then(|| Cut::at_centre(size)),
            coarse_clip: false,
            label_sets: false,
        }
    }
}

/// The rows of a band of [`Schedule::Sweep`]. Band b has the rows `32 b..32 b + 32` of its grid; the last band may have
/// fewer.
pub const BAND_ROWS: usize = 32;

/// The order in which messages are updated. A loop updates every directed message once; [`Schedule::Sweep`] updates those
/// across a seam only once for all loops.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Schedule {
    /// Synchronous: all messages of a loop are computed from those of the loop before.
    Sync,
    /// In half-step t, counted from 0 on every grid, the nodes with (x + y + t) even send, in place. Two half-steps are a
    /// loop (Felzenszwalb and Huttenlocher 2006).
    Checkerboard,
    /// Sequential passes down and up the rows, in place. An edge holds one message: the last one sent over it, in
    /// either direction. Sending over an edge consumes the opposite message, which counts as zeros from then on. A node
    /// is even if x + y is even on its own grid. Nothing is sent to missing neighbours.
    ///
    /// Rows are cut into bands of [`BAND_ROWS`]. The edges between two bands are a seam, which holds a message in each
    /// direction. Both are prepared before the first loop; see [`crate::Seam`]. Loops leave them as they are, so bands do
    /// not depend on each other. A loop runs over each band in two passes:
    ///
    /// 1. Forward, rows from top to bottom. In a row all even nodes send left, right and down, each message computed
    ///    from the messages that the node holds before it sends any; then all odd nodes send down. The last row sends
    ///    nothing down.
    /// 2. Backward, rows from bottom to top. In a row all odd nodes send left, right and up in the same way; then all
    ///    even nodes send up. The first row sends nothing up.
    ///
    /// So after the last loop every vertical edge holds an upward message, and every horizontal edge holds the message from
    /// its odd to its even end. The downward messages of seams count no longer.
    ///
    /// **First messages** of a finer grid come from these edges of the coarser grid. Let M(Q) be, for a coarse node Q,
    ///
    /// - from below: the message that Q received from below;
    /// - from the left: the message that Q received from its left if Q is even, else the one that the left neighbour of Q
    ///   received from its left; zeros if there was none;
    /// - from the right: the same with left and right swapped.
    ///
    /// A fine node (x, y) lies between four coarse nodes. One is its parent P = (x div 2, y div 2). The others are in the column
    /// to the left (x even) or right (x odd), in the row above (y even) or below (y odd), or both. If the node has a neighbour
    /// on that side,
    /// its first message is, with w(a, b) = (((a + b + 1) div 2) + a + 1) div 2, three quarters of a and one of b,
    ///
    /// - from the left or right, of an even node: w of M at P and at the node in the other row;
    /// - from below: the same in P's column and in the other one, then w of both;
    /// - zeros otherwise.
    ///
    /// If the other row does not exist, or receives nothing from that side, P's row takes its place; if the other column does
    /// not exist, P's column does. If P's row receives nothing from that side, the first message is zeros.
    ///
    /// **Labels** of each band are decided one after another, from its top row to its bottom row, in each row first for the
    /// even nodes, then for the odd ones. Let f be the labels already decided and V the smoothness cost. A label is the
    /// smallest that minimises D plus
    ///
    /// - of an even node: `V(d, f_up)` and the messages from the left, the right and below;
    /// - of an odd node: `V(d, f_up) + V(d, f_left) + V(d, f_right)` and the message from below.
    ///
    /// For the first row of a band, f_up are labels that were decided when the seam was prepared. Missing neighbours add
    /// nothing.
    Sweep,
    /// Sequential passing outward from a start node, in place: an experiment with one grid, which only the backends on
    /// processors run. In a loop every node sends once, to all its neighbours, in the order of the distance
    /// `|x - x0| + |y - y0|` from the start node (x0, y0). Each message is computed from what the node holds before it sends any.
    /// Nodes of one distance are no neighbours, so their order has no effect. From (0, 0) this equals the order of rows.
    /// In a cut image, each part's passing starts from its node nearest to the start node.
    Outward {
        /// The node that sends first.
        start: Node,
    },
}

impl Schedule {
    /// The schedules that every backend has: all but the experiment [`Schedule::Outward`].
    pub const ALL: [Self; 3] = [Self::Sync, Self::Checkerboard, Self::Sweep];

    /// The name used in options and records.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Sync => "sync",
            Self::Checkerboard => "checkerboard",
            Self::Sweep => "sweep",
            Self::Outward { .. } => "outward",
        }
    }

    /// The steps of a loop: 1, or 2 half-steps.
    #[must_use]
    pub fn steps_per_loop(self) -> u32 {
        match self {
            Self::Sync | Self::Sweep | Self::Outward { .. } => 1,
            Self::Checkerboard => 2,
        }
    }
}

/// Which message of the next coarser grid a node starts with. The coarsest grid starts with zeros. [`Schedule::Sweep`] has
/// its own rule and requires [`MessageStart::Receiver`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum MessageStart {
    /// A node starts with the messages that its parent received last.
    Receiver,
    /// A node's first message from a neighbour is the one that the neighbour's parent sent last, as in the program of
    /// Felzenszwalb and Huttenlocher.
    Sender,
}

impl MessageStart {
    /// Both starts.
    pub const ALL: [Self; 2] = [Self::Receiver, Self::Sender];

    /// The name used in options and records.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Receiver => "receiver",
            Self::Sender => "sender",
        }
    }
}

/// A cut into four parts that exchange no messages: columns `0..x` and `x..`, rows `0..y` and `y..`. Parts without columns
/// or rows do not exist.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Cut {
    /// The first column right of the cut.
    pub x: usize,
    /// The first row below the cut.
    pub y: usize,
    /// Whether the census match of (x, y) sets the data costs of the nodes around that point; see [`crate::Seed`].
    pub seed_start: bool,
}

impl Cut {
    /// The cut of the thesis, at `(floor(m / 2), floor(n / 2))`, with `seed_start`.
    #[must_use]
    pub fn at_centre(size: Size) -> Self {
        Self { x: size.width / 2, y: size.height / 2, seed_start: true }
    }
}

/// The settings of a plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Settings {
    /// The number of grids (pyramid levels). Grid 0 is the image; each further grid has half the width and height, rounded
    /// up.
    pub grids: u32,
    /// The steps on each grid: loops, or half-steps under [`Schedule::Checkerboard`].
    pub steps: u32,
    /// The order of the message updates.
    pub schedule: Schedule,
    /// The first messages of finer grids.
    pub message_start: MessageStart,
    /// Where the image is cut, if at all.
    pub cut: Option<Cut>,
    /// Whether data costs from grid 1 on are clipped at `K + K div 2`, after each node's least cost is subtracted. Sums for
    /// coarser grids stay unclipped. Clipping lowers the energy and the root mean squared error of [`Algorithm::Sweep`].
    /// It is off for the algorithms of the thesis.
    pub coarse_clip: bool,
    /// Whether the nodes of the finest grids may take only the labels that the next coarser grid's answer makes likely, see
    /// [`LabelSet`](crate::LabelSet). How many grids that are depends on the number of labels
    /// ([`Plan::most_grids_with_label_sets`](crate::Plan::most_grids_with_label_sets)). Only under [`Schedule::Sweep`], and
    /// without effect on fewer than three grids. The coarsest grid always has all labels.
    ///
    /// The labels of the coarser grid are decided as those of grid 0. Then the nodes of each [`Patch`](crate::Patch) of the
    /// next finer grid share a set, and other labels do not exist for them:
    ///
    /// - The data cost of a node is that of its set's labels, less the least of these, clipped as usual.
    /// - A message has a value for each label of the receiver's set: the least, over the labels a of the sender's set, of
    ///   `h(a) + min(s |a - d|, K)`, less the least h.
    /// - Where a message is used for other labels than those of its receiver's set S, its value at d is the least
    ///   `min(M(e) + s |d - e|, K)` over e in S, with s and K of the first level of edges. This applies to the messages that the first messages
    ///   of the finer grid are made from, and to those of a seam, whose rows have other sets than the bands. Where nothing was
    ///   received, it is zeros for all labels.
    /// - A label is the smallest of its node's set that minimises what it minimises otherwise.
    pub label_sets: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_thesis_counts_for_image_1() {
        let baby = Size { width: 620, height: 555 };
        let counts = Algorithm::THESIS.map(|algorithm| {
            let settings = algorithm.settings(baby, 112, 2, Schedule::Sync);
            (settings.grids, settings.steps, settings.cut.is_some())
        });
        assert_eq!(counts, [(1, 112, false), (9, 11, false), (9, 5, false), (1, 112, true), (1, 56, true)]);
        assert_eq!(Algorithm::Ctcsbp.settings(baby, 112, 3, Schedule::Sync).steps, 37);
        let tiny = Size { width: 1, height: 9 };
        assert_eq!(Algorithm::Cfcsbp.settings(tiny, 1, 2, Schedule::Checkerboard).steps, 2);
        assert_eq!(Algorithm::Cfcsbp.settings(tiny, 1, 2, Schedule::Sync).grids, 1);
    }

    #[test]
    fn sweep_has_five_grids_where_they_fit_and_takes_no_counts() {
        let settings = |width, k, schedule| Algorithm::Sweep.settings(Size { width, height: 9 }, k, 3, schedule);
        let of_width = |width| settings(width, 112, Schedule::Sync);
        assert_eq!([1, 3, 15, 63, 64, 620].map(|width| of_width(width).grids), [1, 1, 3, 5, 5, 5]);
        assert_eq!(of_width(620), settings(620, 1, Schedule::Checkerboard));
        assert_eq!((of_width(620).steps, of_width(620).schedule), (1, Schedule::Sweep));
        assert!(of_width(620).coarse_clip && of_width(620).cut.is_none());
    }
}
