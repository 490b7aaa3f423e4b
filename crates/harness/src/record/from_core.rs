//! What records take over from bp-core.

use std::time::Duration;

use bp_core::Stage;

use super::{Clock, Clocked, Cut, Device, Energy, Errors, Finish, Sample, Settings, Stages};

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
    /// What is known of a plan before it runs. `device` says how many bytes it will allocate for it. `k` and `z` are for
    /// the caller to fill in: a plan does not know which numbers its loops came from.
    pub(crate) fn new(
        plan: &bp_core::Plan,
        device: Option<&dyn bp_core::Device>,
        algorithm: bp_core::Algorithm,
    ) -> Self {
        let (model, settings) = (plan.model(), plan.settings());
        Self {
            profile: model.profile().name().to_owned(),
            labels: model.labels(),
            min_disparity: model.min_disparity(),
            slope: model.slope(),
            truncation: model.truncation(),
            edge_threshold: model.weak_edges(),
            algorithm: algorithm.name().to_owned(),
            k: None,
            z: None,
            grids: settings.grids,
            steps_per_grid: settings.steps,
            schedule: settings.schedule.name().to_owned(),
            message_start: settings.message_start.name().to_owned(),
            coarse_clip: settings.coarse_clip,
            cut: settings.cut.map(|bp_core::Cut { x, y, seed_start }| Cut { x, y, seed_start }),
            finish: None,
            message_updates: plan.message_updates(),
            planned_bytes: device.map_or_else(|| plan.bytes(), |device| device.planned_bytes(plan)),
        }
    }
}

impl Finish {
    /// What a map goes through; `None` where that is nothing.
    pub(crate) fn of(finish: bp_core::maps::Finish) -> Option<Self> {
        let bp_core::maps::Finish { check, speckles, fill, median, subpixel } = finish;
        (finish != bp_core::maps::Finish::default()).then_some(Self { check, speckles, fill, median, subpixel })
    }
}

impl Sample {
    /// The times of a solve.
    pub(crate) fn new(round: u32, times: &bp_core::Times) -> Self {
        Self { round, total_ms: milliseconds(times.total), clocks: clocks(times), ..Self::default() }
    }
}

/// The stages of a solve by all clocks.
pub(crate) fn clocks(times: &bp_core::Times) -> Vec<Clocked> {
    let clocked = |clock, stages: [Duration; Stage::ALL.len()]| {
        let stages = Stages::new(stages.map(milliseconds));
        Clocked { clock, stages }
    };
    let device = times.device.map(|stages| clocked(Clock::Device, stages));
    std::iter::once(clocked(Clock::Wall, times.wall)).chain(device).collect()
}

/// In milliseconds.
pub(crate) fn milliseconds(time: Duration) -> f64 {
    1000.0 * time.as_secs_f64()
}
