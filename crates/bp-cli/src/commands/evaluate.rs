//! `bp evaluate`: measures the errors of a disparity map.

use std::{fmt::Write as _, path::Path};

use bp_core::{Distribution, Errors, GroundTruth, MapErrors, THRESHOLDS, finish};
use bp_io::{Error, Limits, Mask, read_map, read_mask};
use bp_stereo::reading_limits;
use serde::Serialize;

use super::{print, print_json};
use crate::{
    args::{EvaluateArgs, TruthArgs},
    failure::Failure,
};

/// The output of `--json`.
#[derive(Serialize)]
struct Report {
    width: usize,
    height: usize,
    #[serde(flatten)]
    errors: ErrorReport,
}

/// The errors of a map over all pixels of known truth, and over the non-occluded ones (`visible`).
#[derive(Clone, Serialize)]
pub(crate) struct ErrorReport {
    thresholds_px: Vec<f32>,
    all: Measured,
    visible: Option<Measured>,
}

/// The errors over a set of pixels, in pixels and percent.
#[derive(Clone, Serialize)]
struct Measured {
    known: usize,
    answered: usize,
    rmse: f64,
    bad: Vec<f64>,
    bad_or_unanswered: Vec<f64>,
    #[serde(flatten)]
    details: Option<Details>,
}

/// What only `bp evaluate` measures, because it needs all errors in order.
#[derive(Clone, Copy, Serialize)]
struct Details {
    mean: f64,
    a50: f64,
    a90: f64,
    a95: f64,
    a99: f64,
    d1: f64,
}

impl From<Errors> for ErrorReport {
    fn from(errors: Errors) -> Self {
        let measured = |MapErrors { known, answered, rmse, bad, bad_or_unanswered }| Measured {
            known: known as usize,
            answered: answered as usize,
            rmse,
            bad: bad.to_vec(),
            bad_or_unanswered: bad_or_unanswered.to_vec(),
            details: None,
        };
        let (all, visible) = (measured(errors.all), errors.visible.map(measured));
        Self { thresholds_px: THRESHOLDS.to_vec(), all, visible }
    }
}

impl ErrorReport {
    /// The names of [`Measured::cells`].
    fn names(&self) -> Vec<String> {
        let [first, last]: [&[&str]; 2] = match self.all.details {
            Some(_) => [&["pixels", "density", "RMSE", "mean error"], &["A50", "A90", "A95", "A99", "D1"]],
            None => [&["pixels", "density", "RMSE"], &[]],
        };
        let thresholds = self.thresholds_px.iter().map(|threshold| format!("> {threshold} px"));
        let [first, last] = [first, last].map(|names| names.iter().map(|&name| name.to_owned()));
        first.chain(thresholds).chain(last).collect()
    }
}

impl Measured {
    fn new(errors: &Distribution, thresholds: &[f32]) -> Self {
        let [a50, a90, a95, a99] = [50, 90, 95, 99].map(|percent| errors.quantile(percent));
        Self {
            known: errors.known(),
            answered: errors.answered(),
            rmse: errors.rmse(),
            bad: thresholds.iter().map(|&threshold| errors.bad(threshold)).collect(),
            bad_or_unanswered: thresholds.iter().map(|&threshold| errors.bad_or_unanswered(threshold)).collect(),
            details: Some(Details { mean: errors.mean(), a50, a90, a95, a99, d1: errors.d1() }),
        }
    }

    /// Each figure over answered pixels, and with unanswered pixels counted as wrong; empty where it would mean nothing.
    fn cells(&self) -> Vec<[String; 2]> {
        let answered = |figure: String| [figure, String::new()];
        let density = 100.0 * self.answered as f64 / self.known as f64;
        let first = [self.known.to_string(), figure(density, 2, "%"), figure(self.rmse, 3, "px")];
        let mean = self.details.map(|details| figure(details.mean, 3, "px"));
        let bad = self.bad.iter().zip(&self.bad_or_unanswered).map(|(&bad, &all)| [bad, all]);
        let last = self.details.into_iter().flat_map(|Details { a50, a90, a95, a99, d1, .. }| {
            let quantiles = [a50, a90, a95, a99].map(|quantile| figure(quantile, 3, "px"));
            quantiles.into_iter().chain([figure(d1, 2, "%")])
        });
        let first = first.into_iter().chain(mean).map(answered);
        let bad = bad.map(|percents| percents.map(|percent| figure(percent, 2, "%")));
        first.chain(bad).chain(last.map(|figure| [String::new(), figure])).collect()
    }
}

/// Runs the command.
pub(crate) fn evaluate(args: &EvaluateArgs) -> Result<(), Failure> {
    let limit = reading_limits(args.max_megapixels);
    let map = read_map(&args.map, args.map_scale, limit)?;
    let truth = read_truth(&args.truth, &args.options, limit)?;
    let map = args.limit.into_iter().fold(map, |map, largest| map.limited(0.0, largest));
    let map = if args.fill { finish::fill(map) } else { map };
    let (map_size, truth_size) = (map.size(), truth.disparities().size());
    if map_size != truth_size {
        let (map, truth) = (args.map.display(), args.truth.display());
        return Err(Failure::input(format!(
            "{map} has {map_size} pixels, but its ground truth {truth} has {truth_size}"
        )));
    }
    let (all, visible) = truth.distributions(&map)?;
    let measured = |errors| Measured::new(errors, &args.thresholds);
    let (all, visible) = (measured(&all), visible.as_ref().map(measured));
    let errors = ErrorReport { thresholds_px: args.thresholds.clone(), all, visible };
    if args.json {
        return print_json(&Report { width: map_size.width, height: map_size.height, errors });
    }
    print(&error_table(&errors))
}

/// Bytes per pixel of ground truth.
const TRUTH: u64 = 4;

/// Reads ground truth, and the right ground truth or the mask that shows its non-occluded pixels.
pub(crate) fn read_truth(path: &Path, options: &TruthArgs, limit: Limits) -> Result<GroundTruth, Error> {
    let truth = read_map(path, options.scale, limit)?;
    if truth.range().is_none() {
        return Err(Error::reading(path, &"ground truth without a known pixel"));
    }
    let limit = limit.without(TRUTH * truth.size().pixels() as u64);
    if let Some(right) = &options.ground_truth_right {
        let map = read_map(right, options.scale, limit)?;
        return GroundTruth::with_right(truth, &map).map_err(|error| Error::reading(right, &error));
    }
    if let Some(mask) = &options.mask {
        let Mask { size, values: visible } = read_mask(mask, limit)?;
        if size != truth.size() {
            return Err(Error::reading(mask, &format!("{size} pixels, but the truth has {}", truth.size())));
        }
        return GroundTruth::with_mask(truth, visible).map_err(|error| Error::reading(mask, &error));
    }
    Ok(GroundTruth::new(truth))
}

/// The errors as text. Each set of pixels has one column for answered pixels, and one that counts unanswered pixels as
/// wrong.
pub(crate) fn error_table(report: &ErrorReport) -> String {
    let sets = [("all known pixels", Some(&report.all)), ("non-occluded pixels", report.visible.as_ref())];
    let sets: Vec<_> = sets.into_iter().filter_map(|(name, errors)| Some((name, errors?))).collect();
    let heads: String = sets.iter().map(|(name, _)| format!("{name:>38}")).collect();
    let columns = format!("{:>19}{:>19}", "answered", "unanswered wrong").repeat(sets.len());
    let mut text = format!("{:<12}{heads}\n{:<12}{columns}\n", "errors", "");
    let sets: Vec<_> = sets.iter().map(|(_, errors)| errors.cells()).collect();
    for (i, name) in report.names().iter().enumerate() {
        let cells: String = sets.iter().flat_map(|cells| &cells[i]).map(|cell| format!("{cell:>19}")).collect();
        let _ = writeln!(text, "{name:<12}{cells}");
    }
    text
}

/// A figure with its unit; a dash if nothing was measured.
fn figure(value: f64, decimals: usize, unit: &str) -> String {
    if value.is_finite() { format!("{value:.decimals$} {unit}") } else { "-".to_owned() }
}
