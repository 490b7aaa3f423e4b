//! What `bp speed` found. These types are the JSON of `speed.json`; what they share with runs of `bp reproduce` is
//! documented in [`crate::record`].

use bp_core::Stage;
use serde::Serialize;

use crate::{
    record::{Clock, Clocked, Device, Machine, Program, Settings, Stages},
    report::format::Spread,
};

/// Version of the schema; changes with every change of meaning.
pub(crate) const SCHEMA_VERSION: u32 = 1;

/// Everything that was measured.
#[derive(Debug, Serialize)]
pub(crate) struct Speed {
    /// [`SCHEMA_VERSION`] of the program that wrote it.
    pub(crate) schema_version: u32,
    /// When it was begun, RFC 3339.
    pub(crate) started: String,
    /// The program.
    pub(crate) program: Program,
    /// The machine.
    pub(crate) machine: Machine,
    /// Whether the images were small.
    pub(crate) quick: bool,
    /// Rounds asked for.
    pub(crate) rounds: u32,
    /// Threads that those contestants share which have threads.
    pub(crate) threads: usize,
    /// Who was asked to take part; the others are compared with the first.
    pub(crate) contestants: Vec<Contestant>,
    /// The problems, in order.
    pub(crate) contests: Vec<Contest>,
}

/// A device of a backend.
#[derive(Debug, Serialize)]
pub(crate) struct Contestant {
    /// Name of the backend, with the device's index unless that is 0.
    pub(crate) name: String,
    /// The device; none where the backend could not open it.
    pub(crate) device: Option<Device>,
    /// Why it could not be opened.
    pub(crate) unavailable: Option<String>,
    /// Milliseconds to open it, its test included, for which kernels may be compiled.
    pub(crate) open_ms: Option<f64>,
    /// 10^9 bytes a second that it reads and writes, together, while it copies its own memory; none where that says
    /// nothing or could not be measured.
    pub(crate) copy_gb_per_s: Option<f64>,
}

/// A problem, and what came of it on every device that could be opened.
#[derive(Debug, Serialize)]
pub(crate) struct Contest {
    /// Name of the problem.
    pub(crate) problem: String,
    /// What grows from it to the next problem, all else being alike; none where there is no such problem, and in
    /// records from before there were any.
    pub(crate) family: Option<Family>,
    /// Pixels per row.
    pub(crate) width: usize,
    /// Pixels per column.
    pub(crate) height: usize,
    /// What was run; the bytes it predicts are those of no device in particular.
    pub(crate) settings: Settings,
    /// SHA-256 of the labels that every contestant gave, two bytes each, low byte first; none where none was measured.
    pub(crate) labels_sha256: Option<String>,
    /// In the order of the contestants.
    pub(crate) entries: Vec<Entry>,
}

/// Problems that are alike but for one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Family {
    /// Pixels of an image.
    Pixels,
    /// Labels of a pixel.
    Labels,
    /// Loops on the one grid.
    Loops,
}

/// A contestant in a contest.
#[derive(Debug, Serialize)]
pub(crate) struct Entry {
    /// Its name.
    pub(crate) contestant: String,
    /// What came of it.
    pub(crate) outcome: Outcome,
}

/// Numbers, or why there are none.
#[derive(Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Outcome {
    /// It ran.
    Measured(Box<Measurement>),
    /// It failed, or gave other labels than those before it.
    Error(String),
    /// The device is too small for the problem; no fault of the run.
    Unavailable(String),
}

/// What was measured.
#[derive(Debug, Serialize)]
pub(crate) struct Measurement {
    /// Milliseconds to make the device ready for the problem, which was done once.
    pub(crate) prepare_ms: f64,
    /// Milliseconds of these that compiling kernels took, where the device compiles any. Kernels that a problem before
    /// this one brought along are not compiled again.
    pub(crate) compile_ms: Option<f64>,
    /// Bytes allocated, counted.
    pub(crate) allocated_bytes: u64,
    /// Bytes that each stage has to read and write at least, where the device counts them.
    pub(crate) moved_bytes: Option<StageBytes>,
    /// Milliseconds of the first solve by the wall clock, which counts in no other number.
    pub(crate) first_ms: f64,
    /// Rounds that it took part in: fewer than asked for where the first solve took long.
    pub(crate) rounds: u32,
    /// Every sample, by round.
    pub(crate) samples: Vec<Sample>,
}

/// One timed solve.
#[derive(Debug, Serialize)]
pub(crate) struct Sample {
    /// Which round of taking turns it belongs to, from 0.
    pub(crate) round: u32,
    /// Milliseconds from images to labels by the wall clock.
    pub(crate) total_ms: f64,
    /// Milliseconds of each stage, by the wall clock first.
    pub(crate) clocks: Vec<Clocked>,
}

/// Bytes of each stage, over all grids; the stages are documented as [`bp_core::Stage`].
#[derive(Debug, Serialize)]
pub(crate) struct StageBytes {
    pub(crate) match_cost: u64,
    pub(crate) coarsen: u64,
    pub(crate) refine: u64,
    pub(crate) update_messages: u64,
    pub(crate) select_labels: u64,
}

impl From<[u64; 5]> for StageBytes {
    fn from([match_cost, coarsen, refine, update_messages, select_labels]: [u64; 5]) -> Self {
        Self { match_cost, coarsen, refine, update_messages, select_labels }
    }
}

impl StageBytes {
    /// The stages in their order.
    pub(crate) fn in_order(&self) -> [u64; 5] {
        let Self { match_cost, coarsen, refine, update_messages, select_labels } = *self;
        [match_cost, coarsen, refine, update_messages, select_labels]
    }
}

impl Family {
    pub(crate) const ALL: [Self; 3] = [Self::Pixels, Self::Labels, Self::Loops];

    /// Its name: what grows.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Pixels => "pixels",
            Self::Labels => "labels",
            Self::Loops => "loops",
        }
    }

    /// The number that grows.
    pub(crate) fn number_of(self, contest: &Contest) -> u64 {
        match self {
            Self::Pixels => contest.width as u64 * contest.height as u64,
            Self::Labels => contest.settings.labels as u64,
            Self::Loops => contest.settings.steps_per_grid.into(),
        }
    }
}

impl Speed {
    /// The problems of a family, or those of none.
    pub(crate) fn contests_of(&self, family: Option<Family>) -> impl Iterator<Item = &Contest> {
        self.contests.iter().filter(move |contest| contest.family == family)
    }

    /// The contestant of an entry.
    pub(crate) fn contestant(&self, entry: &Entry) -> Option<&Contestant> {
        self.contestants.iter().find(|contestant| contestant.name == entry.contestant)
    }

    /// The place of a contestant among all, which its colour tells in charts.
    pub(crate) fn place(&self, name: &str) -> usize {
        self.contestants.iter().position(|contestant| contestant.name == name).unwrap_or(0)
    }

    /// An entry's contestant as tables and charts name it.
    pub(crate) fn label(&self, entry: &Entry) -> String {
        self.contestant(entry).map_or_else(|| entry.contestant.clone(), Contestant::label)
    }
}

impl Contestant {
    /// Whether its stages are timed: a processor's take as long as their calls, of a GPU only its own clock tells.
    pub(crate) fn times_stages(&self, measurement: &Measurement) -> bool {
        self.device.as_ref().is_some_and(|device| device.api.is_none()) || measurement.has_clock()
    }

    /// The stages of a measurement of its that took any time.
    pub(crate) fn stages(&self, measurement: &Measurement) -> impl Iterator<Item = StageTime> {
        let moved = measurement.moved_bytes.as_ref().filter(|_| self.times_stages(measurement));
        let time = move |stage: Stage| {
            let ms = Spread::of(measurement.samples.iter().map(|sample| sample.stages_ms()[stage as usize]))?;
            let bytes = moved.map(|bytes| bytes.in_order()[stage as usize]).filter(|&bytes| bytes > 0);
            (ms.high > 0.0).then_some(StageTime { stage, ms, bytes })
        };
        Stage::ALL.into_iter().filter_map(time)
    }

    /// Its name; what is no GPU says so wherever its times may stand.
    pub(crate) fn label(&self) -> String {
        let software = self.device.as_ref().is_some_and(|device| device.software_rasteriser);
        format!("{}{}", self.name, if software { " (software rasteriser)" } else { "" })
    }
}

impl Outcome {
    /// The measurement, where there is one.
    pub(crate) fn measured(&self) -> Option<&Measurement> {
        match self {
            Self::Measured(measurement) => Some(measurement),
            Self::Error(_) | Self::Unavailable(_) => None,
        }
    }
}

/// A stage that took some time.
pub(crate) struct StageTime {
    pub(crate) stage: Stage,
    pub(crate) ms: Spread,
    /// What it has to read and write at least, where the device counts it and times the stage.
    pub(crate) bytes: Option<u64>,
}

impl StageTime {
    /// 10^9 bytes a second, with their range.
    pub(crate) fn gb_per_s(&self) -> Option<Spread> {
        let bytes = self.bytes? as f64;
        let Spread { median, low, high, count } = self.ms;
        let [median, low, high] = [median, high, low].map(|ms| bytes / (1e6 * ms));
        Some(Spread { median, low, high, count })
    }
}

impl Measurement {
    /// Whether the stages are timed by the device's own clock.
    pub(crate) fn has_clock(&self) -> bool {
        self.samples.iter().all(|sample| sample.device_ms().is_some())
    }
}

impl Sample {
    /// The stages by the device's clock, where it has one.
    pub(crate) fn device_stages(&self) -> Option<Stages> {
        self.clocks.iter().find(|clocked| clocked.clock == Clock::Device).map(|clocked| clocked.stages)
    }

    /// Milliseconds of all stages by the device's clock, where it has one.
    pub(crate) fn device_ms(&self) -> Option<f64> {
        self.device_stages().map(|stages| stages.in_order().iter().sum())
    }

    /// Milliseconds of each stage, by the device's clock where it has one.
    pub(crate) fn stages_ms(&self) -> [f64; 5] {
        self.clocks.last().map_or([0.0; 5], |clocked| clocked.stages.in_order())
    }
}
