//! What a plan ran, and what was done to its map.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a plan runs, and what it predicts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Data cost profile.
    pub profile: String,
    /// Labels (L).
    pub labels: usize,
    /// Disparity of the first label in pixels.
    pub min_disparity: i32,
    /// Slope of the smoothness cost.
    pub slope: u8,
    /// Truncation of the smoothness cost (K).
    pub truncation: u8,
    /// Grey difference above which edges are weak, where any may be; records from before that option lack it.
    #[serde(default)]
    pub edge_threshold: Option<u8>,
    /// Algorithm.
    pub algorithm: String,
    /// Loops asked for (k), where the algorithm derived its own from them.
    pub k: Option<u32>,
    /// What the thesis's coefficient Z divided those by, where it did.
    pub z: Option<u32>,
    /// Number of grids.
    pub grids: usize,
    /// Loops (schedules sync and sweep) or half-steps (checkerboard) on each grid.
    pub steps_per_grid: u32,
    /// Schedule.
    pub schedule: String,
    /// Side by which finer grids take over messages.
    pub message_start: String,
    /// Whether the data costs of grids from 1 on are clipped at K + K div 2; records from before that option lack it.
    #[serde(default)]
    pub coarse_clip: bool,
    /// Where the image is cut.
    pub cut: Option<Cut>,
    /// What was done to the map after matching, where something was.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub finish: Option<Finish>,
    /// Message entries that the plan predicts to compute.
    pub message_updates: u64,
    /// Bytes that the plan predicts on this device, or in general where there is none.
    pub planned_bytes: u64,
}

/// What was done to a map after matching, in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Finish {
    /// Whether a left-right check made pixels unknown.
    pub check: bool,
    /// Surfaces of fewer pixels were made unknown.
    pub speckles: Option<usize>,
    /// Whether unknown pixels were filled.
    pub fill: bool,
    /// Side of the median's window.
    pub median: Option<usize>,
    /// Whether fractions of disparities were made.
    pub subpixel: bool,
}

/// A cut into four parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cut {
    /// First column right of it.
    pub x: usize,
    /// First row below it.
    pub y: usize,
    /// Whether the census match was used as a prior.
    pub seed_start: bool,
}
