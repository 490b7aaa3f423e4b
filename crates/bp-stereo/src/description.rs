//! Plans, devices and answers as they appear in files: sidecars of maps, records of batches and experiments, `--json`.

use std::time::Duration;

use serde::{Deserialize, Serialize};

/// The settings and predictions of a plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Data cost profile.
    pub profile: String,
    /// Labels (L).
    pub labels: usize,
    /// Disparity of the first label in pixels.
    pub min_disparity: i32,
    /// Slope of the smoothness cost, of the first level of edges.
    pub slope: u8,
    /// Truncation of the smoothness cost (K), of the first level.
    pub truncation: u8,
    /// The smoothness costs by grey difference, if not all edges have the same. Records from before 2026-11-23 lack it.
    #[serde(default)]
    pub edge_levels: Vec<EdgeLevel>,
    /// Only in records from before 2026-11-23: the grey difference above which slope and truncation were halved.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub edge_threshold: Option<u8>,
    /// Algorithm.
    pub algorithm: String,
    /// Total number of loops (k), if the algorithm derived the loops on each grid from it.
    pub k: Option<u32>,
    /// The thesis's coefficient Z, which divided the total, if the algorithm uses it.
    pub z: Option<u32>,
    /// Number of grids.
    pub grids: usize,
    /// Loops (schedules sync and sweep) or half-steps (checkerboard) on each grid.
    pub steps_per_grid: u32,
    /// Schedule.
    pub schedule: String,
    /// The rule for the first messages of finer grids.
    pub message_start: String,
    /// Whether the data costs of grids from 1 on are clipped at K + K div 2. Records from before the option lack it.
    #[serde(default)]
    pub coarse_clip: bool,
    /// Whether grids 1 and 0 try only the labels that the coarser ones make likely. Records from before the option lack it.
    #[serde(default)]
    pub label_sets: bool,
    /// Where the image is cut.
    pub cut: Option<Cut>,
    /// Whether the values of the images were stretched to all shades.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub stretched: bool,
    /// How the rows of the images differed, if that was measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rows: Option<Rows>,
    /// The operations on the map after matching, if there were any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub finish: Option<Finish>,
    /// Predicted number of message entries to compute. With label sets, the most that there may be.
    pub message_updates: u64,
    /// Predicted bytes on the device, or in general if no device is given. With label sets, the most that there may be.
    /// Sidecars lack it: it depends on the device and its threads, and they are the same everywhere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub planned_bytes: Option<u64>,
}

/// The smoothness cost of some edges; see [`bp_core::EdgeLevels`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct EdgeLevel {
    /// The greatest difference of the two nodes' grey values.
    pub max_difference: u8,
    /// Slope of the smoothness cost.
    pub slope: u8,
    /// Truncation of the smoothness cost.
    pub truncation: u8,
}

/// How the rows of two images differed; see [`bp_core::Alignment`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Rows {
    /// The least and the largest difference in pixels: how much lower points lie in the right image.
    pub range: [f64; 2],
    /// Whether the right image was resampled so that rows agree. Not needed for very small differences.
    pub corrected: bool,
    /// The coefficients of the quadratic, in pixels.
    pub coefficients: [f64; 6],
}

impl From<&bp_core::Alignment> for Rows {
    fn from(alignment: &bp_core::Alignment) -> Self {
        Self { range: alignment.range(), corrected: !alignment.is_negligible(), coefficients: alignment.coefficients() }
    }
}

/// The operations on a map after matching, in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Finish {
    /// Whether a left-right check made pixels unknown.
    pub check: bool,
    /// Whether pixels were made unknown whose match fits another pixel better.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub unique: bool,
    /// Surfaces with fewer pixels than this were made unknown.
    pub speckles: Option<usize>,
    /// Whether unknown pixels were filled.
    pub fill: bool,
    /// Side of the median filter's window.
    pub median: Option<usize>,
    /// Whether disparities were refined to fractions of a pixel.
    pub subpixel: bool,
}

/// A cut into four parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Cut {
    /// First column right of the cut.
    pub x: usize,
    /// First row below the cut.
    pub y: usize,
    /// Whether the census match was used as a prior.
    pub seed_start: bool,
}

/// A device.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Device {
    /// The name.
    pub name: String,
    /// The kind: "processor", "discrete GPU", "integrated GPU", "virtual GPU", "other device" or "software rasteriser".
    /// Records from before the GPU backends lack it.
    #[serde(default)]
    pub kind: Option<String>,
    /// The API and its version, if any.
    pub api: Option<String>,
    /// The driver and its version, if any.
    pub driver: Option<String>,
    /// Memory of its own in bytes, if any.
    #[serde(default)]
    pub memory_bytes: Option<u64>,
    /// The universally unique identifier that its driver reports.
    #[serde(default)]
    pub uuid: Option<String>,
    /// Whether it is a GPU driver that runs on the CPU.
    pub software_rasteriser: bool,
    /// Number of threads that work at once.
    pub workers: usize,
}

/// A clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Clock {
    /// The host's monotonic clock.
    Wall,
    /// The device's own clock.
    Device,
}

/// Stage times on one clock.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Clocked {
    /// The clock.
    pub clock: Clock,
    /// The times.
    pub stages: Stages,
}

/// Milliseconds of each stage, over all grids.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "the stages are documented as bp_core::Stage")]
pub struct Stages {
    pub match_cost_ms: f64,
    pub coarsen_ms: f64,
    pub refine_ms: f64,
    pub update_messages_ms: f64,
    pub select_labels_ms: f64,
}

/// An energy in the units of its profile.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Energy {
    /// Sum of the data and smoothness costs.
    pub total: u64,
    /// Sum of the data costs.
    pub data: u64,
    /// Sum of the smoothness costs.
    pub smoothness: u64,
}

/// An answer, without its map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// Wall-clock times.
    pub times: Seconds,
    /// The energy of the labels, if the options ask for it.
    pub energy: Option<Energy>,
    /// The settings that were run.
    pub settings: Settings,
    /// Possible problems with the pair or its labels, as sentences.
    pub warnings: Vec<String>,
}

/// The times of an answer, in seconds; see [`crate::AnswerTimes`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Seconds {
    /// Surveying the pair, aligning its rows and making its plan.
    pub planning: f64,
    /// Matching the left image, and the right one if needed.
    pub matching: f64,
    /// Everything else.
    pub finishing: f64,
    /// The sum.
    pub total: f64,
}

/// Errors over a set of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Errors {
    /// Number of pixels with ground truth.
    pub known: u64,
    /// Number of those pixels that have a disparity in the map.
    pub answered: u64,
    /// Root mean squared error over answered pixels, in pixels.
    pub rmse: f64,
    /// Percentages of answered pixels that are wrong by more than 0.5, 1, 2 and 4 pixels.
    pub bad: [f64; 4],
    /// The same percentages of known pixels, with unanswered pixels counted as wrong.
    pub bad_or_unanswered: [f64; 4],
}

impl Stages {
    /// Stage times from an array, in the order of [`bp_core::Stage::ALL`].
    #[must_use]
    pub fn new(ms: [f64; 5]) -> Self {
        let [match_cost_ms, coarsen_ms, refine_ms, update_messages_ms, select_labels_ms] = ms;
        Self { match_cost_ms, coarsen_ms, refine_ms, update_messages_ms, select_labels_ms }
    }

    /// Stage times as an array, in the order of [`bp_core::Stage::ALL`].
    #[must_use]
    pub fn in_order(&self) -> [f64; 5] {
        let Self { match_cost_ms, coarsen_ms, refine_ms, update_messages_ms, select_labels_ms } = *self;
        [match_cost_ms, coarsen_ms, refine_ms, update_messages_ms, select_labels_ms]
    }
}

impl From<bp_core::Energy> for Energy {
    fn from(energy: bp_core::Energy) -> Self {
        Self { total: energy.total(), data: energy.data, smoothness: energy.smoothness }
    }
}

impl From<bp_core::MapErrors> for Errors {
    fn from(errors: bp_core::MapErrors) -> Self {
        let bp_core::MapErrors { known, answered, rmse, bad, bad_or_unanswered } = errors;
        Self { known, answered, rmse, bad, bad_or_unanswered }
    }
}

impl From<&bp_core::DeviceInfo> for Device {
    fn from(device: &bp_core::DeviceInfo) -> Self {
        let bp_core::DeviceInfo { name, kind, api, driver, memory_bytes, uuid, workers } = device.clone();
        let software_rasteriser = kind == bp_core::DeviceKind::SoftwareRasteriser;
        Self { name, kind: Some(kind.name().to_owned()), api, driver, memory_bytes, uuid, software_rasteriser, workers }
    }
}

impl Settings {
    /// Describes a plan before it runs. If a `device` is given, it predicts the bytes. The caller fills in `k` and `z`,
    /// because a plan does not know the numbers that its loops were derived from.
    #[must_use]
    pub fn new(plan: &bp_core::Plan, device: Option<&dyn bp_core::Device>, algorithm: bp_core::Algorithm) -> Self {
        let (model, settings) = (plan.model(), plan.settings());
        Self {
            profile: model.profile().name().to_owned(),
            labels: model.labels(),
            min_disparity: model.min_disparity(),
            slope: model.slope(),
            truncation: model.truncation(),
            edge_levels: edge_levels(model.edges()),
            edge_threshold: None,
            algorithm: algorithm.name().to_owned(),
            k: None,
            z: None,
            grids: settings.grids as usize,
            steps_per_grid: settings.steps,
            schedule: settings.schedule.name().to_owned(),
            message_start: settings.message_start.name().to_owned(),
            coarse_clip: settings.coarse_clip,
            label_sets: settings.label_sets,
            cut: settings.cut.map(|bp_core::Cut { x, y, seed_start }| Cut { x, y, seed_start }),
            stretched: false,
            rows: None,
            finish: None,
            message_updates: plan.message_updates(),
            planned_bytes: Some(device.map_or_else(|| plan.bytes(), |device| device.planned_bytes(plan))),
        }
    }
}

/// Describes the levels up to the one that holds every difference; nothing if all edges have the same cost.
fn edge_levels(edges: &bp_core::EdgeLevels) -> Vec<EdgeLevel> {
    let levels = edges.most().into_iter().zip(edges.smoothness());
    let levels = levels.map(|(max_difference, cost)| EdgeLevel {
        max_difference,
        slope: cost.slope,
        truncation: cost.truncation,
    });
    let last = edges.level(u8::MAX);
    if edges.is_uniform() { Vec::new() } else { levels.take(last + 1).collect() }
}

impl Finish {
    /// Describes the operations on a map; `None` if there are none.
    #[must_use]
    pub fn of(finish: bp_core::finish::Finish) -> Option<Self> {
        let bp_core::finish::Finish { check, unique, speckles, fill, median, subpixel } = finish;
        (finish != bp_core::finish::Finish::default()).then_some(Self {
            check,
            unique,
            speckles,
            fill,
            median,
            subpixel,
        })
    }
}

/// The stage times of a solve on all clocks.
#[must_use]
pub fn clocks(times: &bp_core::Times) -> Vec<Clocked> {
    let clocked = |clock, stages: [Duration; 5]| Clocked { clock, stages: Stages::new(stages.map(milliseconds)) };
    let device = times.device.map(|stages| clocked(Clock::Device, stages));
    std::iter::once(clocked(Clock::Wall, times.wall)).chain(device).collect()
}

/// A time in milliseconds.
#[must_use]
pub fn milliseconds(time: Duration) -> f64 {
    1000.0 * time.as_secs_f64()
}
