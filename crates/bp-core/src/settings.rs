//! What a plan runs, and the thesis's algorithms as ways to fill it.

use crate::Size;

/// The algorithms of Doan Van Tuan's thesis (2019). Each is a way to fill [`Settings`]; nothing else knows their names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
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
}

impl Algorithm {
    /// All algorithms, in the thesis's order.
    pub const ALL: [Self; 5] = [Self::Bp, Self::Cfbp, Self::Cfcsbp, Self::Ctbp, Self::Ctcsbp];

    /// The name used in options and records.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Bp => "bp",
            Self::Cfbp => "cfbp",
            Self::Cfcsbp => "cfcsbp",
            Self::Ctbp => "ctbp",
            Self::Ctcsbp => "ctcsbp",
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
        matches!(self, Self::Cfbp | Self::Cfcsbp)
    }

    /// Whether it cuts the image into four parts.
    #[must_use]
    pub fn is_cut(self) -> bool {
        matches!(self, Self::Ctbp | Self::Ctcsbp)
    }

    /// The thesis's settings for an image of `size`: `k` loops in all (equations 2.37, 2.38, 2.50 and 2.71), divided by
    /// `z` where the algorithm divides, under `schedule`, where a checkerboard loop is two half-steps. No count falls
    /// below 1.
    #[must_use]
    pub fn settings(self, size: Size, k: u32, z: u32, schedule: Schedule) -> Settings {
        let log2 = size.width.max(1).ilog2();
        let levels = if self.is_coarse_to_fine() { log2 + 1 } else { 1 };
        let z = if self.divides_loops() { z.max(1) } else { 1 };
        let loops = (k / (z.saturating_mul(levels))).max(1);
        Settings {
            grids: if self.is_coarse_to_fine() { log2.max(1) as usize } else { 1 },
            steps: loops.saturating_mul(schedule.steps_per_loop()),
            schedule,
            message_start: MessageStart::Receiver,
            cut: self.is_cut().then(|| Cut::at_centre(size)),
        }
    }
}

/// In which order messages are updated. A loop is one update of every directed message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Schedule {
    /// All messages of a loop come from those of the loop before.
    Sync,
    /// Half-step t, counted from 0 on every grid, updates in place what the nodes with (x + y + t) even send; two
    /// half-steps are a loop (Felzenszwalb and Huttenlocher 2006).
    Checkerboard,
}

impl Schedule {
    /// All schedules.
    pub const ALL: [Self; 2] = [Self::Sync, Self::Checkerboard];

    /// The name used in options and records.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Sync => "sync",
            Self::Checkerboard => "checkerboard",
        }
    }

    /// Steps that update every directed message once: 1 loop, or 2 half-steps.
    #[must_use]
    pub fn steps_per_loop(self) -> u32 {
        match self {
            Self::Sync => 1,
            Self::Checkerboard => 2,
        }
    }
}

/// Which of the parent's messages a node of the next finer grid starts with. The coarsest grid starts with zeros.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
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
    pub grids: usize,
    /// Steps on each grid: loops under [`Schedule::Sync`], half-steps under [`Schedule::Checkerboard`].
    pub steps: u32,
    /// Order of the message updates.
    pub schedule: Schedule,
    /// What finer grids start with.
    pub message_start: MessageStart,
    /// Where the image is cut, if it is.
    pub cut: Option<Cut>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_thesis_counts_for_image_1() {
        let baby = Size { width: 620, height: 555 };
        let counts = Algorithm::ALL.map(|algorithm| {
            let settings = algorithm.settings(baby, 112, 2, Schedule::Sync);
            (settings.grids, settings.steps, settings.cut.is_some())
        });
        assert_eq!(counts, [(1, 112, false), (9, 11, false), (9, 5, false), (1, 112, true), (1, 56, true)]);
        assert_eq!(Algorithm::Ctcsbp.settings(baby, 112, 3, Schedule::Sync).steps, 37);
        let tiny = Size { width: 1, height: 9 };
        assert_eq!(Algorithm::Cfcsbp.settings(tiny, 1, 2, Schedule::Checkerboard).steps, 2);
        assert_eq!(Algorithm::Cfcsbp.settings(tiny, 1, 2, Schedule::Sync).grids, 1);
    }
}
