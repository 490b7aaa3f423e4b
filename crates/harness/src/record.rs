//! The record of a run. These types define the JSON of `results/*/record.json`. Its schema is `results/schema.json`,
//! which includes their doc comments.

mod load;
mod sample;
pub mod speed;

pub use bp_stereo::description::milliseconds;
pub use bp_stereo::description::{Clock, Clocked, Cut, Device, Energy, Errors, Finish, Settings, Stages};
pub use load::parse;
pub use load::{MAPS_FOLDER, RECORD_FILE, SPEED_FILE, load, load_speed, record_file};
pub use sample::Sample;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::failure::Failure;

/// Version of the schema. It changes with every change of meaning.
pub const SCHEMA_VERSION: u32 = 1;

/// A run of `bp reproduce`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Record {
    /// [`SCHEMA_VERSION`] of the program that wrote it.
    pub schema_version: u32,
    /// Whether every cell has been run.
    pub complete: bool,
    /// When the run started, RFC 3339.
    pub started: String,
    /// When the record was last written, RFC 3339.
    pub updated: String,
    /// The program.
    pub program: Program,
    /// The machine.
    pub machine: Machine,
    /// The requested run.
    pub run: Run,
    /// The scenes, in order.
    pub scenes: Vec<Scene>,
    /// Every plan on every scene and backend.
    pub cells: Vec<Cell>,
    /// Our labellings and those of others under one energy (profile `mrf`), if the data includes the latter.
    pub labellings: Vec<Labelling>,
}

/// The program that made a record.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Program {
    /// Package version.
    pub version: String,
    /// Git commit that it was built from, or "unknown".
    pub commit: String,
    /// Whether the sources were exactly those of the commit.
    pub clean_tree: bool,
    /// SHA-256 of the program file.
    pub sha256: String,
    /// The compiler.
    pub rustc: String,
    /// Optimisation level, target and flags.
    pub flags: String,
}

/// The machine a record was made on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Machine {
    /// Its name in the folder's name.
    pub name: String,
    /// Processor model.
    pub cpu: String,
    /// Processors that the program may use.
    pub cores: usize,
    /// Main memory in bytes.
    pub memory_bytes: u64,
    /// Operating system.
    pub system: String,
}

/// The requested run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// Which scenes: "middlebury2006" (half size), "middlebury2006-thirdsize", "synthetic" or "synthetic-small".
    pub data: String,
    /// Whether it was a quick run on small images.
    pub quick: bool,
    /// Labels of every scene (L).
    pub labels: usize,
    /// Loops of plain BP (k).
    pub k: u32,
    /// Samples of a cell. One that takes more than [`crate::measure::SLOW_MS`] gets at most
    /// [`crate::measure::SLOW_ROUNDS`] (older records: one).
    pub samples: u32,
    /// Backends, in order.
    pub backends: Vec<String>,
    /// Threads that the multi-threaded backends share. Older records lack it.
    pub threads: Option<usize>,
}

/// A scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Its name.
    pub name: String,
    /// Pixels per row.
    pub width: usize,
    /// Pixels per column.
    pub height: usize,
    /// Largest true disparity in pixels.
    pub largest_disparity: f32,
    /// Pixels of known truth.
    pub known: u64,
    /// Non-occluded pixels of known truth, which both cameras see.
    pub visible: u64,
    /// SHA-256 of the decoded pixels of each image.
    pub images: Vec<ImageSum>,
}

/// An image and its checksum.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ImageSum {
    /// Path below the data folder, or the view of a synthetic scene.
    pub path: String,
    /// SHA-256 of its decoded pixels, row by row, red, green and blue.
    pub sha256: String,
}

/// A plan on a scene and a backend.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cell {
    /// Name of the scene.
    pub scene: String,
    /// Name of the plan in the tables: an algorithm, or one with other settings.
    pub plan: String,
    /// Name of the backend, with the device's index unless that is 0.
    pub backend: String,
    /// The device, unless the backend could not open it.
    pub device: Option<Device>,
    /// The settings of the run.
    pub settings: Settings,
    /// How it used the workers, if not all of them on the whole image. Records from before 2026-11-23 lack it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub arrangement: Option<Arrangement>,
    /// The result.
    pub outcome: Outcome,
}

/// How a plan uses the workers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Arrangement {
    /// One worker has the whole image.
    OneWorker,
    /// Each of the four parts of a cut image has a plan of its own. Workers of one thread take one part after another.
    SideBySide {
        /// The number of workers.
        workers: usize,
    },
    /// Each of the four parts has a plan of its own. All workers share one part after another, in the memory of one.
    InTurn,
}

/// A measurement, or why it is missing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Outcome")]
pub enum Outcome<M = Measurement> {
    /// Not run yet.
    Pending,
    /// It ran.
    Measured(Box<M>),
    /// It failed.
    Error(String),
    /// This machine lacks the backend's device, or the device is too small for the plan. The run is not at fault.
    Unavailable(String),
}

/// The measured values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Measurement {
    /// Every sample, in the order taken. Samples of one round were taken one plan after another.
    pub samples: Vec<Sample>,
    /// Bytes allocated, counted.
    pub allocated_bytes: u64,
    /// Energy of the labelling under its profile.
    pub energy: Energy,
    /// Errors over all pixels of known truth.
    pub all: Errors,
    /// Errors over the non-occluded ones, which both cameras see.
    pub visible: Errors,
    /// SHA-256 of the labels, two bytes each, low byte first.
    pub labels_sha256: String,
    /// The disparity map, a PNG of 16 bits (x256), beside the record.
    pub map: String,
}

/// A labelling and its energy.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Labelling {
    /// Name of the scene.
    pub scene: String,
    /// Its author and method.
    pub method: String,
    /// Whether this program made it.
    pub ours: bool,
    /// Its energy.
    pub energy: Energy,
}

impl<M> Outcome<M> {
    /// The outcome of a failure. A device that is too small for the plan is not the run's fault.
    pub fn failed(failure: &Failure) -> Self {
        let reason = failure.to_string();
        if failure.is_beyond_device() { Self::Unavailable(reason) } else { Self::Error(reason) }
    }

    /// The measurement, if there is one.
    #[must_use]
    pub fn measured(&self) -> Option<&M> {
        match self {
            Self::Measured(measurement) => Some(measurement),
            Self::Pending | Self::Error(_) | Self::Unavailable(_) => None,
        }
    }
}

impl Cell {
    /// The measurement, if there is one.
    #[must_use]
    pub fn measured(&self) -> Option<&Measurement> {
        self.outcome.measured()
    }
}

impl Record {
    /// The cell of a plan on a scene and a backend.
    #[must_use]
    pub fn cell(&self, scene: &str, plan: &str, backend: &str) -> Option<&Cell> {
        self.cells.iter().find(|cell| cell.scene == scene && cell.plan == plan && cell.backend == backend)
    }
}
