//! `bp evaluate`: measures the errors of a disparity map.

use std::{fmt::Write as _, io::Write as _, path::Path};

use bp_core::{Errors, GroundTruth, THRESHOLDS};
use serde::Serialize;

use bp_io::{Error, Limits, Mask, read_map, read_mask};
use bp_stereo::description as record;

use super::{limits::limits, print_json};
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
#[derive(Clone, Copy, Serialize)]
pub(crate) struct ErrorReport {
    thresholds_px: [f32; 4],
    all: record::Errors,
    visible: Option<record::Errors>,
}

impl From<Errors> for ErrorReport {
    fn from(errors: Errors) -> Self {
        Self { thresholds_px: THRESHOLDS, all: errors.all.into(), visible: errors.visible.map(Into::into) }
    }
}

/// Runs the command.
pub(crate) fn evaluate(args: &EvaluateArgs) -> Result<(), Failure> {
    let limit = limits(args.max_megapixels);
    let map = read_map(&args.map, args.map_scale, limit)?;
    let truth = read_truth(&args.truth, &args.options, limit)?;
    let errors = truth.errors(&map).map_err(|_| {
        let (map_size, truth_size) = (map.size(), truth.disparities().size());
        let (map, truth) = (args.map.display(), args.truth.display());
        Failure::input(format!("{map} has {map_size} pixels, but its ground truth {truth} has {truth_size}"))
    })?;
    let errors = ErrorReport::from(errors);
    if args.json {
        let size = map.size();
        return print_json(&Report { width: size.width, height: size.height, errors });
    }
    Ok(write!(std::io::stdout(), "{}", error_table(&errors))?)
}

/// Reads ground truth, and the right ground truth or the mask that shows its non-occluded pixels.
pub(crate) fn read_truth(path: &Path, options: &TruthArgs, limit: Limits) -> Result<GroundTruth, Failure> {
    let truth = read_map(path, options.scale, limit)?;
    if truth.range().is_none() {
        return Err(Error::reading(path, &"ground truth without a known pixel").into());
    }
    if let Some(right) = &options.ground_truth_right {
        let map = read_map(right, options.scale, limit)?;
        return GroundTruth::with_right(truth, &map).map_err(|error| Error::reading(right, &error).into());
    }
    if let Some(mask) = &options.mask {
        let Mask { size, values: visible } = read_mask(mask, limit)?;
        if size != truth.size() {
            return Err(Error::reading(mask, &format!("{size} pixels, but the truth has {}", truth.size())).into());
        }
        if !visible.contains(&true) {
            return Err(Error::reading(mask, &"no pixel is 255, so the mask selects none").into());
        }
        return GroundTruth::with_mask(truth, visible).map_err(|error| Error::reading(mask, &error).into());
    }
    Ok(GroundTruth::new(truth))
}

/// The errors as text. Each set of pixels has one column for answered pixels, and one that counts unanswered pixels as
/// wrong.
pub(crate) fn error_table(report: &ErrorReport) -> String {
    let sets = [("all known pixels", Some(&report.all)), ("non-occluded pixels", report.visible.as_ref())];
    let sets: Vec<_> = sets.into_iter().filter_map(|(name, errors)| Some((name, errors?))).collect();
    let mut text = String::new();
    let mut line = |name: &str, cells: &dyn Fn(&record::Errors) -> [String; 2]| {
        let cells: String =
            sets.iter().map(|(_, errors)| cells(errors).map(|cell| format!("{cell:>19}")).concat()).collect();
        let _ = writeln!(text, "{name:<12}{cells}");
    };
    let pair = |first: String| [first, String::new()];
    line("pixels", &|errors| pair(errors.known.to_string()));
    line("density", &|errors| pair(figure(100.0 * errors.answered as f64 / errors.known as f64, 2, "%")));
    line("RMSE", &|errors| pair(figure(errors.rmse, 3, "px")));
    for (i, threshold) in THRESHOLDS.iter().enumerate() {
        let percents = |errors: &record::Errors| [errors.bad[i], errors.bad_or_unanswered[i]];
        line(&format!("> {threshold} px"), &|errors| percents(errors).map(|percent| figure(percent, 2, "%")));
    }
    let heads: String = sets.iter().map(|(name, _)| format!("{name:>38}")).collect();
    let columns = format!("{:>19}{:>19}", "answered", "unanswered wrong").repeat(sets.len());
    format!("{:<12}{heads}\n{:<12}{columns}\n{text}", "errors", "")
}

/// A figure with its unit; a dash if nothing was measured.
fn figure(value: f64, decimals: usize, unit: &str) -> String {
    if value.is_finite() { format!("{value:.decimals$} {unit}") } else { "-".to_owned() }
}
