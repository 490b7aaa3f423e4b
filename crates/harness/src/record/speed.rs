//! The record of `bp speed`. These types define the JSON of `speed.json`. Those that it shares with `record.json` are
//! in [`crate::record`].

use bp_core::Stage;
use serde::{Deserialize, Serialize};

use super::{Device, Machine, Outcome, Program, Sample, Settings};
use crate::statistics::Spread;

/// Version of the schema. It changes with every change of meaning.
pub const SCHEMA_VERSION: u32 = 1;

/// A run of `bp speed`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Speed {
    /// [`SCHEMA_VERSION`] of the program that wrote it.
    pub schema_version: u32,
    /// When the run started, RFC 3339.
    pub started: String,
    /// The program.
    pub program: Program,
    /// The machine.
    pub machine: Machine,
    /// Whether it was a quick run on small images.
    pub quick: bool,
    /// Requested rounds.
    pub rounds: u32,
    /// Threads of the pool that contestants share unless they have their own.
    pub threads: usize,
    /// The requested contestants. The others are compared with the first.
    pub contestants: Vec<Contestant>,
    /// The problems, in order.
    pub contests: Vec<Contest>,
}

/// A device of a backend.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Contestant {
    /// Name of the backend, with the device's index unless that is 0.
    pub name: String,
    /// The device, unless the backend could not open it.
    pub device: Option<Device>,
    /// Why it could not be opened.
    pub unavailable: Option<String>,
    /// Milliseconds to open and test it, which may include compiling kernels.
    pub open_ms: Option<f64>,
    /// 10^9 bytes per second that it reads and writes in total while it copies its own memory; `None` if that means
    /// nothing or could not be measured.
    pub copy_gb_per_s: Option<f64>,
}

/// A problem and its results on every device that could be opened.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Contest {
    /// Name of the problem.
    pub problem: String,
    /// The family, if the problem belongs to one. Its problems differ in one number only. Older records have no
    /// families.
    #[serde(default)]
    pub family: Option<Family>,
    /// Pixels per row.
    pub width: usize,
    /// Pixels per column.
    pub height: usize,
    /// The settings. The predicted bytes are not those of a particular device.
    pub settings: Settings,
    /// SHA-256 of the labels that every contestant gave, two bytes each, low byte first; `None` if no solve succeeded.
    pub labels_sha256: Option<String>,
    /// The results, in the order of the contestants.
    pub entries: Vec<Entry>,
}

/// Problems that differ in one number only, which names the family.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Family {
    /// Pixels of an image.
    Pixels,
    /// Labels of a pixel.
    Labels,
    /// Loops on the only grid.
    Loops,
    /// Pixels, up to 30 megapixels, by the schedule `sweep`.
    SweepPixels,
    /// Pixels, up to 30 megapixels, by half-steps on one grid.
    HalfStepPixels,
    /// Labels, by half-steps on one grid.
    HalfStepLabels,
}

/// A contestant in a contest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// Its name.
    pub contestant: String,
    /// The result. Labels that differ from those of the contestants before it are an error.
    pub outcome: Outcome<Measurement>,
}

/// The measured values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Measurement {
    /// Milliseconds to prepare the device for the problem, which happens once.
    pub prepare_ms: f64,
    /// The part of these spent compiling kernels, if the device compiles any. Kernels that an earlier problem compiled
    /// are not compiled again.
    pub compile_ms: Option<f64>,
    /// Bytes allocated, counted.
    pub allocated_bytes: u64,
    /// The least bytes that each stage has to read and write, if the device counts them.
    pub moved_bytes: Option<StageBytes>,
    /// Wall-clock milliseconds of the first solve, which is not one of the samples.
    pub first_ms: f64,
    /// Its number of rounds: fewer than requested if the first solve was slow.
    pub rounds: u32,
    /// Every sample, by round.
    pub samples: Vec<Sample>,
}

/// Bytes of each stage, over all grids.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "the stages are documented as bp_core::Stage")]
pub struct StageBytes {
    pub match_cost: u64,
    pub coarsen: u64,
    pub refine: u64,
    pub update_messages: u64,
    pub select_labels: u64,
}

impl From<[u64; 5]> for StageBytes {
    fn from([match_cost, coarsen, refine, update_messages, select_labels]: [u64; 5]) -> Self {
        Self { match_cost, coarsen, refine, update_messages, select_labels }
    }
}

impl StageBytes {
    /// The stages in their order.
    pub fn in_order(&self) -> [u64; 5] {
        let Self { match_cost, coarsen, refine, update_messages, select_labels } = *self;
        [match_cost, coarsen, refine, update_messages, select_labels]
    }
}

impl Family {
    /// All families.
    pub const ALL: [Self; 6] =
        [Self::Pixels, Self::Labels, Self::Loops, Self::SweepPixels, Self::HalfStepPixels, Self::HalfStepLabels];

    /// Its name in options and file names.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pixels => "pixels",
            Self::Labels => "labels",
            Self::Loops => "loops",
            Self::SweepPixels => "sweep-pixels",
            Self::HalfStepPixels => "half-step-pixels",
            Self::HalfStepLabels => "half-step-labels",
        }
    }

    /// The name of the number that varies.
    pub const fn grows(self) -> &'static str {
        match self {
            Self::Pixels | Self::SweepPixels | Self::HalfStepPixels => "pixels",
            Self::Labels | Self::HalfStepLabels => "labels",
            Self::Loops => "loops",
        }
    }

    /// The number that varies, for a problem of the family.
    pub fn number_of(self, contest: &Contest) -> u64 {
        match self {
            Self::Pixels | Self::SweepPixels | Self::HalfStepPixels => contest.width as u64 * contest.height as u64,
            Self::Labels | Self::HalfStepLabels => contest.settings.labels as u64,
            Self::Loops => contest.settings.steps_per_grid.into(),
        }
    }
}

impl Speed {
    /// The problems of a family, or those without one.
    pub fn contests_of(&self, family: Option<Family>) -> impl Iterator<Item = &Contest> {
        self.contests.iter().filter(move |contest| contest.family == family)
    }

    /// The contestant of an entry.
    pub fn contestant(&self, entry: &Entry) -> Option<&Contestant> {
        self.contestants.iter().find(|contestant| contestant.name == entry.contestant)
    }

    /// The index of a contestant, which decides its colour in charts.
    pub fn place(&self, name: &str) -> usize {
        self.contestants.iter().position(|contestant| contestant.name == name).unwrap_or(0)
    }

    /// The name of an entry's contestant in tables and charts.
    pub fn label(&self, entry: &Entry) -> String {
        self.contestant(entry).map_or_else(|| entry.contestant.clone(), Contestant::label)
    }
}

impl Contestant {
    /// Whether its stages are timed. A CPU's take as long as their calls; a GPU's can be timed only by its own clock.
    pub fn times_stages(&self, measurement: &Measurement) -> bool {
        self.device.as_ref().is_some_and(|device| device.api.is_none()) || measurement.has_clock()
    }

    /// The stages that took any time in one of its measurements.
    pub fn stages(&self, measurement: &Measurement) -> impl Iterator<Item = StageTime> {
        let moved = measurement.moved_bytes.as_ref().filter(|_| self.times_stages(measurement));
        let time = move |stage: Stage| {
            let ms = Sample::spread(&measurement.samples, |sample| sample.stages_ms()[stage as usize])?;
            let bytes = moved.map(|bytes| bytes.in_order()[stage as usize]).filter(|&bytes| bytes > 0);
            (ms.high > 0.0).then_some(StageTime { stage, ms, bytes })
        };
        Stage::ALL.into_iter().filter_map(time)
    }

    /// Its name in tables and charts, which always marks a software rasteriser, since that is no GPU.
    pub fn label(&self) -> String {
        let software = self.device.as_ref().is_some_and(|device| device.software_rasteriser);
        format!("{}{}", self.name, if software { " (software rasteriser)" } else { "" })
    }
}

/// A stage that took some time.
pub struct StageTime {
    /// The stage.
    pub stage: Stage,
    /// Milliseconds.
    pub ms: Spread,
    /// The least bytes that it has to read and write, if the device counts them and times the stage.
    pub bytes: Option<u64>,
}

impl StageTime {
    /// 10^9 bytes per second, with their range.
    pub fn gb_per_s(&self) -> Option<Spread> {
        let bytes = self.bytes? as f64;
        let Spread { median, low, high, count } = self.ms;
        let [median, low, high] = [median, high, low].map(|ms| bytes / (1e6 * ms));
        Some(Spread { median, low, high, count })
    }
}

impl Measurement {
    /// Whether the stages are timed by the device's own clock.
    pub fn has_clock(&self) -> bool {
        self.samples.iter().all(|sample| sample.device_ms().is_some())
    }
}
