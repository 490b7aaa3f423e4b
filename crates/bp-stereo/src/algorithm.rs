//! The algorithms and their options.

use bp_core::{Cut, LabelSet, MessageStart, Schedule, Settings, Size};
use serde::{Deserialize, Serialize};

use crate::Error;

/// A matching algorithm. [`Algorithm::Sweep`] is ours; the others are those of Doan Van Tuan's PhD thesis (2019).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "name", rename_all = "kebab-case")]
pub enum Algorithm {
    /// Coarse to fine with sequential passes ([`Schedule::Sweep`]) and one message per edge.
    Sweep {
        /// Number of grids. `None` means five, or fewer if the image is small.
        #[serde(default)]
        grids: Option<u32>,
        /// Loops on each grid.
        #[serde(default = "one")]
        loops: u32,
        /// Whether the data costs of coarse grids are clipped; see [`Settings::coarse_clip`].
        #[serde(default = "yes")]
        coarse_clip: bool,
        /// Whether the finest grids try only the labels that the coarser ones make likely; see
        /// [`Settings::label_sets`]. `None` means from 32 labels on.
        #[serde(default)]
        label_sets: Option<bool>,
    },
    /// Plain belief propagation on one grid.
    Bp {
        /// The number of loops.
        #[serde(default)]
        loops: Loops,
    },
    /// Coarse-to-fine belief propagation.
    Cfbp {
        /// The number of loops.
        #[serde(default)]
        loops: Loops,
        /// The grids.
        #[serde(default)]
        hierarchy: Hierarchy,
    },
    /// Coarse-to-fine constant-space belief propagation: fewer loops.
    Cfcsbp {
        /// The number of loops.
        #[serde(default)]
        loops: Loops,
        /// The grids.
        #[serde(default)]
        hierarchy: Hierarchy,
        /// The divisor of [`Loops::Total`] (Z''); `None` means 2. Invalid with the other kinds of [`Loops`].
        #[serde(default)]
        z: Option<u32>,
    },
    /// Census-transform belief propagation: four parts, cut at the centre of the image.
    Ctbp {
        /// The number of loops.
        #[serde(default)]
        loops: Loops,
        /// Whether the census match of the centre is used as a prior.
        #[serde(default = "yes")]
        seed_start: bool,
    },
    /// Census-transform constant-space belief propagation: four parts and fewer loops.
    Ctcsbp {
        /// The number of loops.
        #[serde(default)]
        loops: Loops,
        /// Whether the census match of the centre is used as a prior.
        #[serde(default = "yes")]
        seed_start: bool,
        /// The divisor of [`Loops::Total`] (Z''''); `None` means 2. Invalid with the other kinds of [`Loops`].
        #[serde(default)]
        z: Option<u32>,
    },
}

/// How long the thesis's algorithms pass messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Loops {
    /// A total number of loops (k). The algorithm derives the number for each grid from it.
    Total {
        /// The total; `None` means the number of labels.
        k: Option<u32>,
        /// Order of message updates.
        schedule: Schedule,
    },
    /// The same number of loops on each grid.
    OnEachGrid {
        /// Loops on each grid.
        loops: u32,
        /// Order of message updates.
        schedule: Schedule,
    },
    /// The same number of checkerboard half-steps on each grid.
    HalfSteps(u32),
}

/// The thesis's choice: as many loops as labels, with all messages of a loop updated at once.
impl Default for Loops {
    fn default() -> Self {
        Self::Total { k: None, schedule: Schedule::Sync }
    }
}

/// How a coarse-to-fine algorithm uses its grids.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Hierarchy {
    /// Number of grids; invalid with [`Loops::Total`]. `None` means the thesis's floor(log2 m), where m is the width.
    pub grids: Option<u32>,
    /// The first messages of finer grids.
    pub message_start: MessageStart,
    /// Whether the data costs of coarse grids are clipped; see [`Settings::coarse_clip`].
    pub coarse_clip: bool,
    /// Whether the finest grids try only the labels that the coarser ones make likely; see [`Settings::label_sets`].
    /// Needs [`Schedule::Sweep`].
    pub label_sets: bool,
}

impl Default for Hierarchy {
    fn default() -> Self {
        Self { grids: None, message_start: MessageStart::Receiver, coarse_clip: false, label_sets: false }
    }
}

/// The numbers from which an algorithm derived its loops, if it did.
#[derive(Default)]
pub(crate) struct Derived {
    /// The total number of loops.
    pub(crate) k: Option<u32>,
    /// Their divisor.
    pub(crate) z: Option<u32>,
}

/// The default of the thesis's divisor Z.
const Z: u32 = 2;

fn one() -> u32 {
    1
}

fn yes() -> bool {
    true
}

/// [`Algorithm::Sweep`] with its default options.
impl Default for Algorithm {
    fn default() -> Self {
        Self::Sweep { grids: None, loops: 1, coarse_clip: true, label_sets: None }
    }
}

impl Algorithm {
    /// The algorithm without its options, as [`bp_core`] knows it.
    #[must_use]
    pub fn kind(&self) -> bp_core::Algorithm {
        match self {
            Self::Sweep { .. } => bp_core::Algorithm::Sweep,
            Self::Bp { .. } => bp_core::Algorithm::Bp,
            Self::Cfbp { .. } => bp_core::Algorithm::Cfbp,
            Self::Cfcsbp { .. } => bp_core::Algorithm::Cfcsbp,
            Self::Ctbp { .. } => bp_core::Algorithm::Ctbp,
            Self::Ctcsbp { .. } => bp_core::Algorithm::Ctcsbp,
        }
    }

    /// Whether the schedule is [`Schedule::Sweep`], which keeps no messages from one pair to the next.
    pub(crate) fn is_swept(&self) -> bool {
        self.loops().is_none_or(|loops| loops.schedule() == Schedule::Sweep)
    }

    /// Fails if options contradict each other.
    pub(crate) fn check(&self) -> Result<(), Error> {
        if matches!(self.loops().map(Loops::schedule), Some(Schedule::Outward { .. })) {
            return Err(Error::Options(
                "the schedule `outward` is an experiment of `bp-core`: take another".to_owned(),
            ));
        }
        let is_total = matches!(self.loops(), Some(Loops::Total { .. }));
        if self.hierarchy().is_some_and(|hierarchy| hierarchy.grids.is_some()) && is_total {
            return Err(Error::Options("`grids` needs `loops` that count on each grid".to_owned()));
        }
        if self.hierarchy().is_some_and(|hierarchy| hierarchy.label_sets) && !self.is_swept() {
            return Err(Error::Options("`label_sets` needs the schedule `sweep`".to_owned()));
        }
        if self.z().is_some() && !is_total {
            return Err(Error::Options("`z` divides loops in all, not those on each grid".to_owned()));
        }
        Ok(())
    }

    /// The settings of a plan for images of this size and this number of labels.
    pub(crate) fn settings(&self, size: Size, labels: usize) -> Settings {
        let Some(passing) = self.loops() else { return self.swept(size, labels) };
        let (k, schedule) = (passing.k(labels), passing.schedule());
        let own = self.kind().settings(size, k, self.z().unwrap_or(Z), schedule);
        let hierarchy = self.hierarchy().unwrap_or_default();
        Settings {
            grids: hierarchy.grids.unwrap_or(own.grids),
            steps: passing.steps().unwrap_or(own.steps),
            message_start: hierarchy.message_start,
            coarse_clip: hierarchy.coarse_clip,
            label_sets: hierarchy.label_sets,
            cut: own.cut.map(|cut| Cut { seed_start: self.seed_start(), ..cut }),
            ..own
        }
    }

    fn swept(&self, size: Size, labels: usize) -> Settings {
        let own = bp_core::Algorithm::Sweep.settings(size, 1, 1, Schedule::Sweep);
        match *self {
            Self::Sweep { grids, loops, coarse_clip, label_sets } => {
                let label_sets = label_sets.unwrap_or(labels >= LabelSet::WORTHWHILE);
                Settings { grids: grids.unwrap_or(own.grids), steps: loops, coarse_clip, label_sets, ..own }
            }
            _ => own,
        }
    }

    /// The numbers from which the loops of a plan with this many labels were derived.
    pub(crate) fn derived(&self, labels: usize) -> Derived {
        match self.loops() {
            Some(passing @ Loops::Total { .. }) => {
                let z = self.kind().divides_loops().then(|| self.z().unwrap_or(Z));
                Derived { k: Some(passing.k(labels)), z }
            }
            _ => Derived::default(),
        }
    }

    fn loops(&self) -> Option<Loops> {
        match *self {
            Self::Sweep { .. } => None,
            Self::Bp { loops }
            | Self::Cfbp { loops, .. }
            | Self::Cfcsbp { loops, .. }
            | Self::Ctbp { loops, .. }
            | Self::Ctcsbp { loops, .. } => Some(loops),
        }
    }

    fn hierarchy(&self) -> Option<Hierarchy> {
        match *self {
            Self::Cfbp { hierarchy, .. } | Self::Cfcsbp { hierarchy, .. } => Some(hierarchy),
            _ => None,
        }
    }

    fn z(&self) -> Option<u32> {
        match *self {
            Self::Cfcsbp { z, .. } | Self::Ctcsbp { z, .. } => z,
            _ => None,
        }
    }

    fn seed_start(&self) -> bool {
        matches!(self, Self::Ctbp { seed_start: true, .. } | Self::Ctcsbp { seed_start: true, .. })
    }
}

impl Loops {
    fn schedule(self) -> Schedule {
        match self {
            Self::Total { schedule, .. } | Self::OnEachGrid { schedule, .. } => schedule,
            Self::HalfSteps(_) => Schedule::Checkerboard,
        }
    }

    /// The total number of loops for this number of labels.
    fn k(self, labels: usize) -> u32 {
        match self {
            Self::Total { k: Some(k), .. } => k,
            _ => labels as u32,
        }
    }

    /// Steps on each grid, unless the algorithm derives them.
    fn steps(self) -> Option<u32> {
        match self {
            Self::Total { .. } => None,
            Self::OnEachGrid { loops, schedule } => Some(loops.saturating_mul(schedule.steps_per_loop())),
            Self::HalfSteps(steps) => Some(steps),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn label_sets_are_the_default_of_sweep_where_they_save_time() {
        let size = Size { width: 300, height: 200 };
        let label_sets = |label_sets, labels| {
            Algorithm::Sweep { grids: None, loops: 1, coarse_clip: true, label_sets }.settings(size, labels).label_sets
        };
        assert_eq!([31, 32, 1024].map(|labels| label_sets(None, labels)), [false, true, true]);
        assert_eq!([Some(true), Some(false)].map(|asked| label_sets(asked, 31)), [true, false]);
        assert!(!label_sets(Some(false), 200));
        let schedule = Schedule::Sync;
        let hierarchy = Hierarchy { label_sets: true, ..Hierarchy::default() };
        let cfbp = |schedule| Algorithm::Cfbp { loops: Loops::Total { k: None, schedule }, hierarchy };
        assert!(cfbp(schedule).check().is_err() && cfbp(Schedule::Sweep).check().is_ok());
        let start = bp_core::Node { x: 0, y: 0 };
        let outward = Loops::Total { k: None, schedule: Schedule::Outward { start } };
        assert!(Algorithm::Bp { loops: outward }.check().is_err(), "an experiment of bp-core only");
        assert!(cfbp(Schedule::Sweep).settings(size, 50).label_sets);
    }
}
