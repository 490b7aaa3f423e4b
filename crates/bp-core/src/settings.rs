//! What a plan runs, and the algorithms as ways to fill it.

use crate::Size;

/// The algorithms of Doan Van Tuan's thesis (2019), and one of ours. Each is a way to fill [`Settings`]; nothing else
/// knows their names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Algorithm {
    /// Plain belief propagation: k loops on the full grid.
    Bp,
    /// Coarse to fine: `floor(log2 m)` grids, `floor(k / (floor(log2 m) + 1))` loops on each.
    Cfbp,
    /// Coarse to fine with Z'' times fewer loops.
    Cfcsbp,
    /// Four parts, cut at the image's centre, whose match the census transform finds.
    Ctbp,
    /// The same with Z'''' times fewer loops.
    Ctcsbp,
    /// Ours: coarse to fine on five grids with one loop of [`Schedule::Sweep`] on each.
    Sweep,
}

impl Algorithm {
    /// The thesis's algorithms, in its order.
    pub const THESIS: [Self; 5] = [Self::Bp, Self::Cfbp, Self::Cfcsbp, Self::Ctbp, Self::Ctcsbp];

    /// All algorithms: the thesis's, then ours.
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

    /// The thesis's settings for an image of `size`: `k` loops in all (equations 2.37, 2.38, 2.50 and 2.71), divided by
    /// `z` where the algorithm divides, under `schedule`, where a checkerboard loop is two half-steps. No count falls
    /// below 1. [`Algorithm::Sweep`] has settings of its own and takes nothing but the size.
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
        }
    }
}

/// Rows of a band of [`Schedule::Sweep`]: band b has the rows `32 b..32 b + 32` of its grid, the last perhaps fewer.
pub const BAND_ROWS: usize = 32;

/// In which order messages are updated. A loop is one update of every directed message; under [`Schedule::Sweep`] of
/// all but those across a seam.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Schedule {
    /// All messages of a loop come from those of the loop before.
    Sync,
    /// Half-step t, counted from 0 on every grid, updates in place what the nodes with (x + y + t) even send; two
    /// half-steps are a loop (Felzenszwalb and Huttenlocher 2006).
    Checkerboard,
    /// Sequential passes down and up the rows, in place. An edge holds one message, the one sent last over it, either
    /// way: sending takes the place of what came the other way, which is used up and counts as zeros for its receiver.
    /// A node is even where (x + y) of its own grid is even. Where there is no neighbour, nothing is sent.
    ///
    /// Rows are cut into bands of [`BAND_ROWS`]; the edges between two bands are a seam. Nothing is sent across a seam,
    /// so that bands are independent of each other: in all loops a band's last row holds its first message from below,
    /// and its first row nothing from above. A loop processes each band so:
    ///
    /// 1. Forward, rows from top to bottom. In a row all even nodes send left, right and down, each message computed
    ///    from what the node holds before it sends any; then all odd nodes send down. The band's last row sends
    ///    nothing down.
    /// 2. Backward, rows from bottom to top. In a row all odd nodes send left, right and up, computed likewise; then
    ///    all even nodes send up. The band's first row sends nothing up.
    ///
    /// So after a loop every vertical edge holds a message up, that of a seam the first one; every horizontal edge holds
    /// the message from its odd to its even end.
    ///
    /// **First messages** of a finer grid are what those edges hold on the coarser one. The parent P of (x, y) is
    /// (x div 2, y div 2). From below every node starts with what P received from below; from above with zeros. From
    /// left and right only even nodes start with a message: from the left with what P received from its left where P
    /// is even, else with what P's left neighbour received from its left, zeros where P has none; from the right
    /// likewise with left and right swapped. As everywhere, only where the node has a neighbour on that side.
    ///
    /// **Labels** of each band are decided one after another, from its top row to its bottom row, in a row first of even
    /// nodes, then of odd ones. A label is the smallest that minimises D plus, with f the labels of neighbours decided
    /// before and V the smoothness cost,
    ///
    /// - of an even node: `V(d, f_up)` and the messages from the left, the right and below;
    /// - of an odd node: `V(d, f_up) + V(d, f_left) + V(d, f_right)` and the message from below.
    ///
    /// `V(d, f_up)` is left out in the first row of every band, and every term where there is no neighbour.
    Sweep,
}

impl Schedule {
    /// All schedules.
    pub const ALL: [Self; 3] = [Self::Sync, Self::Checkerboard, Self::Sweep];

    /// The name used in options and records.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Sync => "sync",
            Self::Checkerboard => "checkerboard",
            Self::Sweep => "sweep",
        }
    }

    /// Steps of a loop: 1, or 2 half-steps.
    #[must_use]
    pub fn steps_per_loop(self) -> u32 {
        match self {
            Self::Sync | Self::Sweep => 1,
            Self::Checkerboard => 2,
        }
    }
}

/// Which of the parent's messages a node of the next finer grid starts with. The coarsest grid starts with zeros.
/// [`Schedule::Sweep`] says itself what is taken over, and goes with [`MessageStart::Receiver`] only.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum MessageStart {
    /// A node receives at first what its parent received last.
    Receiver,
    /// A node sends at first what its parent sent last (as in Felzenszwalb and Huttenlocher's program).
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

/// A cut into four parts that exchange no message: columns `0..x` and `x..`, rows `0..y` and `y..`. A part without
/// columns or rows does not exist.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Cut {
    /// First column right of the cut.
    pub x: usize,
    /// First row below the cut.
    pub y: usize,
    /// Whether the census match of (x, y) fixes the data cost of the nodes around that point, see [`crate::Seed`].
    pub seed_start: bool,
}

impl Cut {
    /// The thesis's cut at `(floor(m / 2), floor(n / 2))`, with `seed_start`.
    #[must_use]
    pub fn at_centre(size: Size) -> Self {
        Self { x: size.width / 2, y: size.height / 2, seed_start: true }
    }
}

/// What a plan runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Settings {
    /// Number of grids; grid 0 is the image, each further one has half the width and height, rounded up.
    pub grids: u32,
    /// Steps on each grid: loops, or half-steps under [`Schedule::Checkerboard`].
    pub steps: u32,
    /// Order of the message updates.
    pub schedule: Schedule,
    /// What finer grids start with.
    pub message_start: MessageStart,
    /// Where the image is cut, if it is.
    pub cut: Option<Cut>,
    /// Whether the data costs of grids from 1 on are clipped at `K + K div 2`, each node's least one taken off before;
    /// sums for coarser grids stay unclipped. It lowers energy and root mean squared error of [`Algorithm::Sweep`]; off
    /// for the thesis's algorithms.
    pub coarse_clip: bool,
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
