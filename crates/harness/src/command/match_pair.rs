//! `bp match`: the disparity map of one's own pair.

use std::{
    io::Write as _,
    path::{Path, PathBuf},
};

use bp_core::{Errors, GroundTruth, Plan, Size, StereoPair};

use super::{evaluate, print_json};
use crate::{
    args::MatchArgs,
    failure::Failure,
    files::{PixelLimit, read_image},
    interrupt,
    matching::{self, Outputs, Report, Session, batch, plan},
    note, threads,
};

/// Runs the command.
pub(crate) fn match_pair(args: &MatchArgs) -> Result<(), Failure> {
    plan::check_options(&args.plan)?;
    let (Some(left), Some(right)) = (&args.left, &args.right) else { return batch::match_all(args) };
    let truth_options =
        args.truth.ground_truth_right.is_some() || args.truth.mask.is_some() || args.truth.scale.is_some();
    if args.ground_truth.is_none() && truth_options {
        return Err(Failure::usage("--ground-truth-right, --mask and --scale need --ground-truth"));
    }
    let truths = [&args.ground_truth, &args.truth.ground_truth_right, &args.truth.mask].into_iter().flatten();
    let outputs = Outputs::of(args);
    let inputs: Vec<&Path> = [left, right].into_iter().chain(truths).map(PathBuf::as_path).collect();
    outputs.check(&inputs)?;
    let limit = PixelLimit::megapixels(args.max_megapixels);
    let pair = read_pair(left, right, limit)?;
    let plan = plan::plan(&args.plan, pair.size())?;
    outputs.check_range(plan.model())?;
    warn_of_labels(&plan);
    let truth = args.ground_truth.as_deref().map(|path| read_truth(args, path, pair.size(), limit)).transpose()?;
    interrupt::listen()?;
    let report = threads::run_on(args.plan.threads, || run(args, &pair, plan, truth.as_ref(), &outputs))?;
    if args.json { print_json(&report) } else { Ok(write!(std::io::stdout(), "{}", matching::text(&report))?) }
}

/// Matches the pair and writes its files.
fn run(
    args: &MatchArgs,
    pair: &StereoPair,
    plan: Plan,
    truth: Option<&GroundTruth>,
    outputs: &Outputs,
) -> Result<Report, Failure> {
    let mut session = Session::open(args)?;
    let answer = session.solve(pair, plan)?;
    let errors: Option<Errors> = truth.map(|truth| truth.errors(&answer.map)).transpose()?;
    outputs.write(&answer)?;
    Ok(Report::new(pair, session.opened(), answer, errors, outputs))
}

/// Warns of labels that match nothing inside the right image.
pub(crate) fn warn_of_labels(plan: &Plan) {
    let (model, width) = (plan.model(), plan.image_size().width);
    if model.labels() > width {
        let labels = model.labels();
        note(&format!("warning: {labels} labels for images {width} pixels wide: the last ones match nowhere"));
    }
    let matches_any = |label| (model.disparity(label).unsigned_abs() as usize) < width;
    if !(0..model.labels() as u16).any(matches_any) {
        note("warning: with this --min-disparity no label matches anything inside the right image");
    }
}

/// Reads both images of a pair.
pub(crate) fn read_pair(left: &Path, right: &Path, limit: PixelLimit) -> Result<StereoPair, Failure> {
    let named = |error| Failure::input(format!("{} and {}: {error}", left.display(), right.display()));
    StereoPair::new(read_image(left, limit)?, read_image(right, limit)?).map_err(named)
}

fn read_truth(args: &MatchArgs, path: &Path, size: Size, limit: PixelLimit) -> Result<GroundTruth, Failure> {
    let truth = evaluate::read_truth(path, &args.truth, limit)?;
    let found = truth.disparities().size();
    if found == size {
        return Ok(truth);
    }
    Err(Failure::input(format!("{}: {found} pixels where the images have {size}", path.display())))
}
