//! The report of `bp match` on one pair, as text or as JSON.

use std::{fmt::Write as _, path::PathBuf};

use bp_core::{Errors, Size, Stage};
use bp_stereo::{
    Align, AnswerTimes, Disparity, Matcher, Tiles,
    description::{self, Clocked, Energy, Rows, Settings, clocks, milliseconds},
};
use bytesize::ByteSize;
use serde::Serialize;

use super::evaluate::{self, ErrorReport};

/// Version of the JSON report. Every change of meaning raises it.
const SCHEMA_VERSION: u32 = 1;

/// The output of `--json`.
#[derive(Serialize)]
pub(super) struct Report {
    schema_version: u32,
    width: usize,
    height: usize,
    backend: String,
    device: description::Device,
    settings: Settings,
    /// Whether rows should have been aligned, but too few points agree.
    #[serde(skip)]
    is_unaligned: bool,
    /// `None` if the pair was matched as a whole.
    tiles: Option<Tiles>,
    /// The message entries that were computed for one image. The settings hold the prediction.
    message_updates: u64,
    allocated_bytes: u64,
    /// Predicted peak memory of the program.
    peak_bytes: u64,
    /// The total time of each match, in order.
    samples_ms: Vec<f64>,
    /// The median of the samples, the parts of it before and after matching, and the stages of that match. The stages include both
    /// images if both were matched.
    total_ms: f64,
    planning_ms: f64,
    finishing_ms: f64,
    clocks: Vec<Clocked>,
    energy: Option<Energy>,
    errors: Option<ErrorReport>,
    messages_sha256: Option<String>,
    /// Warnings about the images or the labels, as printed to standard error.
    warnings: Vec<String>,
    /// The files, the disparity map first.
    written: Vec<String>,
}

/// The parts of a report that are not in the answer.
pub(super) struct Asked {
    pub(super) size: Size,
    pub(super) warnings: Vec<String>,
    pub(super) errors: Option<Errors>,
    pub(super) messages_sha256: Option<String>,
}

impl Report {
    /// The report of one or several matches: the last answer, and the times of all.
    pub(super) fn new(
        matcher: &Matcher,
        answer: Disparity,
        times: &[AnswerTimes],
        asked: Asked,
        written: Vec<PathBuf>,
    ) -> Self {
        let median = median(times);
        Self {
            schema_version: SCHEMA_VERSION,
            width: asked.size.width,
            height: asked.size.height,
            backend: matcher.device_name().to_owned(),
            device: matcher.device().into(),
            is_unaligned: answer.settings.rows.is_none() && matcher.options().align != Align::Off,
            settings: answer.settings,
            tiles: answer.tiles,
            message_updates: answer.message_updates,
            allocated_bytes: answer.allocated_bytes,
            peak_bytes: answer.peak_bytes,
            samples_ms: times.iter().map(total_ms).collect(),
            total_ms: total_ms(&median),
            planning_ms: milliseconds(median.planning),
            finishing_ms: milliseconds(median.finishing),
            clocks: clocks(&median.matching),
            energy: answer.energy.map(Into::into),
            errors: asked.errors.map(Into::into),
            messages_sha256: asked.messages_sha256,
            warnings: asked.warnings,
            written: written.iter().map(|path| path.display().to_string()).collect(),
        }
    }
}

/// The sample with the median total; the lower middle one if the number of samples is even.
fn median(samples: &[AnswerTimes]) -> AnswerTimes {
    let mut sorted = samples.to_vec();
    sorted.sort_by_key(AnswerTimes::total);
    sorted[(samples.len() - 1) / 2]
}

fn total_ms(sample: &AnswerTimes) -> f64 {
    milliseconds(sample.total())
}

/// The range of several samples.
fn spread(samples_ms: &[f64]) -> String {
    let low = samples_ms.iter().copied().fold(f64::INFINITY, f64::min);
    let high = samples_ms.iter().copied().fold(0.0, f64::max);
    let count = samples_ms.len();
    if count > 1 { format!(", median of {count} from {low:.1} to {high:.1} ms") } else { String::new() }
}

/// How the rows of the images differ, if it was measured.
fn rows(report: &Report) -> String {
    let text = match report.settings.rows {
        Some(Rows { range: [least, largest], corrected: true, .. }) => {
            format!("differ by {least:.2} to {largest:.2} px; corrected")
        }
        Some(_) => "agree".to_owned(),
        None if report.is_unaligned => "not aligned: too few points agree".to_owned(),
        None => return String::new(),
    };
    format!("{:<10}{text}\n", "rows")
}

/// The report as text.
pub(super) fn text(report: &Report) -> String {
    let mut text = String::new();
    let Report { width, height, settings, .. } = report;
    let Settings { labels, min_disparity, algorithm, profile, grids, steps_per_grid, schedule, .. } = settings;
    let last = min_disparity + *labels as i32 - 1;
    let _ = writeln!(text, "{:<10}{width}x{height} pixels, {labels} labels ({min_disparity} to {last} px)", "pair");
    text += &rows(report);
    let steps = if schedule == "checkerboard" { "half-steps" } else { "loops" };
    let plan = format!("{algorithm}, profile {profile}, {grids} grids x {steps_per_grid} {steps} ({schedule})");
    let software = if report.device.software_rasteriser { " (software rasteriser)" } else { "" };
    let _ = writeln!(text, "{:<10}{plan}, on {}: {}{software}", "plan", report.backend, report.device.name);
    if let Some(Tiles { columns, rows, width, height, answer }) = &report.tiles {
        let _ = writeln!(text, "{:<10}{columns}x{rows} of up to {width}x{height} pixels, {answer}", "tiles");
    }
    let _ = writeln!(text, "{:<10}{:.1} ms in total{}", "time", report.total_ms, spread(&report.samples_ms));
    let _ = writeln!(text, "{:<14}{:<16}{:>10.1} ms", "", "before matching", report.planning_ms);
    for Clocked { clock, stages } in &report.clocks {
        let _ = writeln!(text, "{:<12}{clock:?} clock", "");
        for (stage, ms) in Stage::ALL.into_iter().zip(stages.in_order()) {
            let _ = writeln!(text, "{:<14}{:<16}{ms:>10.1} ms", "", stage.name());
        }
    }
    if settings.finish.is_some() {
        let _ = writeln!(text, "{:<14}{:<16}{:>10.1} ms", "", "after matching", report.finishing_ms);
    }
    let [planned, allocated, peak] =
        [settings.planned_bytes.unwrap_or_default(), report.allocated_bytes, report.peak_bytes]
            .map(|bytes| ByteSize(bytes).display().iec());
    let all = format!("{peak} with images and answer");
    let _ = writeln!(text, "{:<10}{allocated} allocated, {planned} predicted, {all}", "memory");
    if let Some(Energy { total, data, smoothness }) = report.energy {
        let _ = writeln!(text, "{:<10}{total} = {data} data + {smoothness} smoothness", "energy");
    }
    if let Some(hash) = &report.messages_sha256 {
        let _ = writeln!(text, "{:<10}sha256 {hash}", "messages");
    }
    if let Some(errors) = &report.errors {
        text += &evaluate::error_table(errors);
    }
    let _ = writeln!(text, "{:<10}{}", "written", report.written.join(", "));
    text
}
