//! `bp evaluate`: the errors of a disparity map.

use std::{fmt::Write as _, io::Write as _, path::Path};

use bp_core::{DisparityMap, Errors, GroundTruth, MapErrors, THRESHOLDS};
use serde::Serialize;

use crate::{
    args::{EvaluateArgs, TruthArgs},
    failure::Failure,
    files::{PixelLimit, read_map, read_mask},
    record,
};

/// What `--json` prints.
#[derive(Serialize)]
struct Report {
    width: usize,
    height: usize,
    #[serde(flatten)]
    errors: ErrorReport,
}

/// The errors of a map over all pixels of known truth and over visible ones.
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
    let limit = PixelLimit::megapixels(args.max_megapixels);
    let map = read_map(&args.map, args.map_scale, limit)?;
    let truth = read_truth(&args.truth, &args.options, limit)?;
    let errors = measure(&map, &truth, &args.map, &args.truth)?;
    let mut out = std::io::stdout().lock();
    if args.json {
        let size = map.size();
        let report = Report { width: size.width, height: size.height, errors: errors.into() };
        serde_json::to_writer_pretty(&mut out, &report).map_err(std::io::Error::from)?;
        writeln!(out)?;
    } else {
        write!(out, "{}", error_table(&errors))?;
    }
    Ok(())
}

/// Reads ground truth, and what tells which of its pixels are visible.
pub(crate) fn read_truth(path: &Path, options: &TruthArgs, limit: PixelLimit) -> Result<GroundTruth, Failure> {
    let truth = read_map(path, options.scale, limit)?;
    if let Some(right) = &options.ground_truth_right {
        let map = read_map(right, options.scale, limit)?;
        return GroundTruth::with_right(truth, &map).map_err(|error| Failure::reading(right, &error));
    }
    if let Some(mask) = &options.mask {
        let (size, visible) = read_mask(mask, limit)?;
        if size != truth.size() {
            return Err(Failure::reading(mask, &format!("{size} pixels where the truth has {}", truth.size())));
        }
        return GroundTruth::with_mask(truth, visible).map_err(|error| Failure::reading(mask, &error));
    }
    Ok(GroundTruth::new(truth))
}

/// Errors of a map; sizes that differ are told with both files' names.
pub(crate) fn measure(
    map: &DisparityMap,
    truth: &GroundTruth,
    map_path: &Path,
    truth_path: &Path,
) -> Result<Errors, Failure> {
    truth.errors(map).map_err(|_| {
        let (map_size, truth_size) = (map.size(), truth.disparities.size());
        let (map_path, truth_path) = (map_path.display(), truth_path.display());
        Failure::input(format!("{map_path} has {map_size} pixels and its ground truth {truth_path} {truth_size}"))
    })
}

/// Errors as text.
pub(crate) fn error_table(errors: &Errors) -> String {
    let mut text = String::new();
    let header = THRESHOLDS.map(|threshold| format!("> {threshold} px %")).map(|head| format!("{head:>10}")).concat();
    let _ = writeln!(text, "{:<28}{:>9}{:>9}{:>9}{header}", "errors over", "pixels", "density%", "RMSE px");
    let mut row = |name: &str, errors: &MapErrors| {
        let density = 100.0 * errors.answered as f64 / errors.known.max(1) as f64;
        let bad = errors.bad.map(|bad| format!("{bad:>10.2}")).concat();
        let _ = writeln!(text, "{name:<28}{:>9}{density:>9.2}{:>9.3}{bad}", errors.known, errors.rmse);
        if errors.answered < errors.known {
            let bad = errors.bad_or_unanswered.map(|bad| format!("{bad:>10.2}")).concat();
            let _ = writeln!(text, "{:<28}{:>27}{bad}", "  unanswered counted wrong", "");
        }
    };
    row("all known pixels", &errors.all);
    if let Some(visible) = &errors.visible {
        row("visible in both views", visible);
    }
    text
}
