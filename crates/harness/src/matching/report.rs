//! What is told of a match, as text or as JSON.

use std::{fmt::Write as _, path::PathBuf, time::Duration};

use bp_core::{Errors, Stage, StereoPair, Tiling};
use serde::{Deserialize, Serialize};

use super::{Answer, Sample};
use crate::{
    backends::Opened,
    command::evaluate::{self, ErrorReport},
    record,
};

/// What `--json` prints.
#[derive(Serialize)]
pub(crate) struct Report {
    width: usize,
    height: usize,
    backend: String,
    device: record::Device,
    settings: record::Settings,
    /// None where the pair was matched as a whole.
    tiles: Option<Tiles>,
    allocated_bytes: u64,
    /// Most that the program was predicted to hold at a time.
    peak_bytes: u64,
    /// Of every match, in order.
    samples_ms: Vec<f64>,
    /// The median of these, what of it came after matching, and the stages of that match; of both images' where both
    /// were matched.
    total_ms: f64,
    finishing_ms: f64,
    clocks: Vec<record::Clocked>,
    energy: record::Energy,
    errors: Option<ErrorReport>,
    messages_sha256: Option<String>,
    /// What may be wrong with the images or the labels, as standard error tells it.
    warnings: Vec<String>,
    /// The files, the disparity map first.
    written: Vec<String>,
}

/// What a pair was cut into.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Tiles {
    /// Beside each other.
    columns: usize,
    /// Above each other.
    rows: usize,
    /// The most that one matches, in pixels.
    width: usize,
    height: usize,
    /// How near the answer is to the whole image's.
    answer: String,
}

impl Tiles {
    /// What is told of a tiling.
    pub(crate) fn of(tiling: &Tiling) -> Option<Self> {
        let ((columns, rows), size) = (tiling.counts(), tiling.tile_size());
        let answer = tiling.likeness().name().to_owned();
        (!tiling.is_whole()).then_some(Self { columns, rows, width: size.width, height: size.height, answer })
    }
}

impl Report {
    /// What is told of an answer.
    pub(crate) fn new(
        pair: &StereoPair,
        opened: &Opened,
        answer: Answer,
        errors: Option<Errors>,
        warnings: Vec<String>,
        written: Vec<PathBuf>,
    ) -> Self {
        let median = median(&answer.samples);
        Self {
            width: pair.size().width,
            height: pair.size().height,
            backend: opened.name.clone(),
            device: (&opened.info).into(),
            settings: answer.settings,
            tiles: answer.tiles,
            allocated_bytes: answer.allocated_bytes,
            peak_bytes: answer.peak_bytes,
            samples_ms: answer.samples.iter().map(total_ms).collect(),
            total_ms: total_ms(&median),
            finishing_ms: milliseconds(median.finishing),
            clocks: record::clocks(&median.matching),
            energy: answer.energy.into(),
            errors: errors.map(Into::into),
            messages_sha256: answer.messages_sha256,
            warnings,
            written: written.iter().map(|path| path.display().to_string()).collect(),
        }
    }
}

/// The sample of median total; of an even number, the lower one of the two in the middle.
fn median(samples: &[Sample]) -> Sample {
    let mut sorted = samples.to_vec();
    sorted.sort_by_key(Sample::total);
    sorted[(samples.len() - 1) / 2]
}

fn total_ms(sample: &Sample) -> f64 {
    milliseconds(sample.total())
}

fn milliseconds(time: Duration) -> f64 {
    1000.0 * time.as_secs_f64()
}

/// The range of several samples.
fn spread(samples_ms: &[f64]) -> String {
    let low = samples_ms.iter().copied().fold(f64::INFINITY, f64::min);
    let high = samples_ms.iter().copied().fold(0.0, f64::max);
    let count = samples_ms.len();
    if count > 1 { format!(", median of {count} from {low:.1} to {high:.1} ms") } else { String::new() }
}

/// The report as text.
pub(crate) fn text(report: &Report) -> String {
    let mut text = String::new();
    let Report { width, height, settings, .. } = report;
    let record::Settings { labels, min_disparity, algorithm, profile, grids, steps_per_grid, schedule, .. } = settings;
    let last = min_disparity + *labels as i32 - 1;
    let _ = writeln!(text, "{:<10}{width}x{height} pixels, {labels} labels ({min_disparity} to {last} px)", "pair");
    let steps = if schedule == "checkerboard" { "half-steps" } else { "loops" };
    let plan = format!("{algorithm}, profile {profile}, {grids} grids x {steps_per_grid} {steps} ({schedule})");
    let software = if report.device.software_rasteriser { " (software rasteriser)" } else { "" };
    let _ = writeln!(text, "{:<10}{plan}, on {}: {}{software}", "plan", report.backend, report.device.name);
    if let Some(Tiles { columns, rows, width, height, answer }) = &report.tiles {
        let _ = writeln!(text, "{:<10}{columns}x{rows} of up to {width}x{height} pixels, {answer}", "tiles");
    }
    let _ = writeln!(text, "{:<10}{:.1} ms in all{}", "time", report.total_ms, spread(&report.samples_ms));
    for record::Clocked { clock, stages } in &report.clocks {
        let _ = writeln!(text, "{:<12}{clock:?} clock", "");
        for (stage, ms) in Stage::ALL.into_iter().zip(stages.in_order()) {
            let _ = writeln!(text, "{:<14}{:<16}{ms:>10.1} ms", "", stage.name());
        }
    }
    if settings.finish.is_some() {
        let _ = writeln!(text, "{:<14}{:<16}{:>10.1} ms", "", "after matching", report.finishing_ms);
    }
    let mebibytes = |bytes: u64| bytes as f64 / f64::from(1 << 20);
    let (planned, allocated) = (mebibytes(settings.planned_bytes), mebibytes(report.allocated_bytes));
    let peak = mebibytes(report.peak_bytes);
    let all = format!("{peak:.1} MiB with images and answer");
    let _ = writeln!(text, "{:<10}{allocated:.1} MiB allocated, {planned:.1} MiB predicted, {all}", "memory");
    let record::Energy { total, data, smoothness } = report.energy;
    let _ = writeln!(text, "{:<10}{total} = {data} data + {smoothness} smoothness", "energy");
    if let Some(hash) = &report.messages_sha256 {
        let _ = writeln!(text, "{:<10}sha256 {hash}", "messages");
    }
    if let Some(errors) = &report.errors {
        text += &evaluate::error_table(errors);
    }
    let _ = writeln!(text, "{:<10}{}", "written", report.written.join(", "));
    text
}
