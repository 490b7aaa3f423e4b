//! What `bp speed` found. These types are the JSON of `speed.json`; the types that it shares with `record.json` are in
//! [`crate::record`].

use bp_core::Stage;
use serde::{Deserialize, Serialize};

use super::{Device, Machine, Outcome, Program, Sample, Settings};
use crate::statistics::Spread;

/// Version of the schema; changes with every change of meaning.
pub const SCHEMA_VERSION: u32 = 1;

/// Everything that was measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Speed {
    /// [`SCHEMA_VERSION`] of the program that wrote it.
    pub schema_version: u32,
    /// When it was begun, RFC 3339.
    pub started: String,
    /// The program.
    pub program: Program,
    /// The machine.
    pub machine: Machine,
    /// Whether the images were small.
    pub quick: bool,
    /// Rounds asked for.
    pub rounds: u32,
    /// Threads that those contestants share which have threads.
    pub threads: usize,
    /// Who was asked to take part; the others are compared with the first.
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
    /// The device; none where the backend could not open it.
    pub device: Option<Device>,
    /// Why it could not be opened.
    pub unavailable: Option<String>,
    /// Milliseconds to open it, its test included, for which kernels may be compiled.
    pub open_ms: Option<f64>,
    /// 10^9 bytes a second that it reads and writes, together, while it copies its own memory; none where that says
    /// nothing or could not be measured.
    pub copy_gb_per_s: Option<f64>,
}

/// A problem, and what came of it on every device that could be opened.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Contest {
    /// Name of the problem.
    pub problem: String,
    /// What grows from it to the next problem, all else being alike; none where there is no such problem, and in
    /// records from before there were any.
    #[serde(default)]
    pub family: Option<Family>,
    /// Pixels per row.
    pub width: usize,
    /// Pixels per column.
    pub height: usize,
    /// What was run; the bytes it predicts are those of no device in particular.
    pub settings: Settings,
    /// SHA-256 of the labels that every contestant gave, two bytes each, low byte first; none where none was measured.
    pub labels_sha256: Option<String>,
    /// In the order of the contestants.
    pub entries: Vec<Entry>,
}

/// Problems that are alike but for one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Family {
    /// Pixels of an image.
    Pixels,
    /// Labels of a pixel.
    Labels,
    /// Loops on the one grid.
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
    /// What came of it. Other labels than those of the contestants before it are an error.
    pub outcome: Outcome<Measurement>,
}

/// What was measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Measurement {
    /// Milliseconds to make the device ready for the problem, which was done once.
    pub prepare_ms: f64,
    /// Milliseconds of these that compiling kernels took, where the device compiles any. Kernels that a problem before
    /// this one brought along are not compiled again.
    pub compile_ms: Option<f64>,
    /// Bytes allocated, counted.
    pub allocated_bytes: u64,
    /// Bytes that each stage has to read and write at least, where the device counts them.
    pub moved_bytes: Option<StageBytes>,
    /// Milliseconds of the first solve by the wall clock, which counts in no other number.
    pub first_ms: f64,
    /// Rounds that it took part in: fewer than asked for where the first solve took long.
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

    /// What grows.
    pub const fn grows(self) -> &'static str {
        match self {
            Self::Pixels | Self::SweepPixels | Self::HalfStepPixels => "pixels",
            Self::Labels | Self::HalfStepLabels => "labels",
            Self::Loops => "loops",
        }
    }

    /// The number that grows.
    pub fn number_of(self, contest: &Contest) -> u64 {
        match self {
            Self::Pixels | Self::SweepPixels | Self::HalfStepPixels => contest.width as u64 * contest.height as u64,
            Self::Labels | Self::HalfStepLabels => contest.settings.labels as u64,
            Self::Loops => contest.settings.steps_per_grid.into(),
        }
    }
}

impl Speed {
    /// The problems of a family, or those of none.
    pub fn contests_of(&self, family: Option<Family>) -> impl Iterator<Item = &Contest> {
        self.contests.iter().filter(move |contest| contest.family == family)
    }

    /// The contestant of an entry.
    pub fn contestant(&self, entry: &Entry) -> Option<&Contestant> {
        self.contestants.iter().find(|contestant| contestant.name == entry.contestant)
    }

    /// The place of a contestant among all, which its colour tells in charts.
    pub fn place(&self, name: &str) -> usize {
        self.contestants.iter().position(|contestant| contestant.name == name).unwrap_or(0)
    }

    /// An entry's contestant as tables and charts name it.
    pub fn label(&self, entry: &Entry) -> String {
        self.contestant(entry).map_or_else(|| entry.contestant.clone(), Contestant::label)
    }
}

impl Contestant {
    /// Whether its stages are timed: a processor's take as long as their calls, of a GPU only its own clock tells.
    pub fn times_stages(&self, measurement: &Measurement) -> bool {
        self.device.as_ref().is_some_and(|device| device.api.is_none()) || measurement.has_clock()
    }

    /// The stages of a measurement of its that took any time.
    pub fn stages(&self, measurement: &Measurement) -> impl Iterator<Item = StageTime> {
        let moved = measurement.moved_bytes.as_ref().filter(|_| self.times_stages(measurement));
        let time = move |stage: Stage| {
            let ms = Sample::spread(&measurement.samples, |sample| sample.stages_ms()[stage as usize])?;
            let bytes = moved.map(|bytes| bytes.in_order()[stage as usize]).filter(|&bytes| bytes > 0);
            (ms.high > 0.0).then_some(StageTime { stage, ms, bytes })
        };
        Stage::ALL.into_iter().filter_map(time)
    }

    /// Its name; what is no GPU says so wherever its times may stand.
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
    /// What it has to read and write at least, where the device counts it and times the stage.
    pub bytes: Option<u64>,
}

impl StageTime {
    /// 10^9 bytes a second, with their range.
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
