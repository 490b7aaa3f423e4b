//! `bp match`: the disparity map of one's own pair.

use std::{
    io::Write as _,
    path::{Path, PathBuf},
};

use bp_core::{Errors, GroundTruth, Plan, Size, StereoPair, survey::Survey};

use super::{evaluate, print_json};
use crate::{
    args::{Labels, MatchArgs, PlanArgs},
    failure::Failure,
    files::{PixelLimit, read_image},
    heap, interrupt,
    matching::{self, Content, Making, Outputs, Report, Session, batch, labels, plan, warnings},
    note, threads, warn_of_pair,
};

/// Runs the command.
pub(crate) fn match_pair(args: &MatchArgs) -> Result<(), Failure> {
    heap::return_large_buffers();
    check_options(args)?;
    let (Some(left), Some(right)) = (&args.left, &args.right) else { return batch::match_all(args) };
    let truths = [&args.ground_truth, &args.truth.ground_truth_right, &args.truth.mask].into_iter().flatten();
    let confidence = args.finish.confidence.clone();
    let outputs = Outputs { confidence, ..Outputs::of(Some(&args.output), &args.outputs) };
    let making = Making::of(&args.outputs)?;
    let inputs: Vec<&Path> = sources(args).chain(truths.map(PathBuf::as_path)).collect();
    outputs.check(&making, &inputs)?;
    let limit = PixelLimit::megapixels(args.max_megapixels);
    let pair = read_pair(left, right, limit)?;
    let survey = Survey::of(&pair)?;
    let (plan, warnings) = planned(&args.plan, [left, right], pair.size(), &survey, (&outputs, &making))?;
    if args.plan.labels == Some(Labels::Auto) {
        let (model, labels) = (plan.model(), plan.model().labels());
        let (low, high) = (model.min_disparity(), model.disparity(labels as u16 - 1));
        note(&format!("--labels auto: {labels} labels, from {low} to {high} px"));
    }
    let truth = args.ground_truth.as_deref().map(|path| read_truth(args, path, pair.size(), limit)).transpose()?;
    interrupt::listen()?;
    let outputs = (&outputs, &making);
    let report = threads::run_on(args.plan.threads, || run(args, &pair, plan, truth.as_ref(), warnings, outputs))?;
    if args.json { print_json(&report) } else { Ok(write!(std::io::stdout(), "{}", matching::text(&report))?) }
}

/// Refuses options that do nothing without others, or contradict one another.
fn check_options(args: &MatchArgs) -> Result<(), Failure> {
    plan::check_options(&args.plan)?;
    if args.finish.fill.is_some() && args.finish.check.is_none() && args.finish.speckle.is_none() {
        return Err(Failure::usage("--fill needs --check or --speckle, which leave something to fill"));
    }
    let truth_options =
        args.truth.ground_truth_right.is_some() || args.truth.mask.is_some() || args.truth.scale.is_some();
    if args.ground_truth.is_none() && truth_options {
        return Err(Failure::usage("--ground-truth-right, --mask and --scale need --ground-truth"));
    }
    // Clap does not ask for --video where --pairs or two images stand in its place.
    if args.many.warm_start.is_some() && args.many.video.is_none() {
        return Err(Failure::usage("--warm-start needs --video: pairs of different scenes have nothing in common"));
    }
    Ok(())
}

/// The plan for a pair, which its outputs can hold, and what may be wrong with the two: that is told too.
pub(crate) fn planned(
    args: &PlanArgs,
    files: [&Path; 2],
    size: Size,
    survey: &Survey,
    (outputs, making): (&Outputs, &Making),
) -> Result<(Plan, Vec<String>), Failure> {
    let range = labels::range(args, size, survey, outputs);
    let plan = plan::plan(args, size, range.unwrap_or_else(|| labels::default(args, size)))?;
    let warnings = warnings::of(args, survey, &plan, files, range.is_none());
    // Told first: exchanged images may be why the outputs cannot hold what is asked for.
    warnings.iter().for_each(|warning| warn_of_pair(warning));
    outputs.check_model(making, plan.model(), size)?;
    Ok((plan, warnings))
}

/// Matches the pair and writes its files.
fn run(
    args: &MatchArgs,
    pair: &StereoPair,
    plan: Plan,
    truth: Option<&GroundTruth>,
    warnings: Vec<String>,
    (outputs, making): (&Outputs, &Making),
) -> Result<Report, Failure> {
    let mut session = Session::open(args)?;
    let answer = session.solve(pair, plan)?;
    let errors: Option<Errors> = truth.map(|truth| truth.errors(&answer.map)).transpose()?;
    let inputs: Vec<&Path> = sources(args).collect();
    let (image, plan) = (Some(pair.left()), Some(&answer.settings));
    let confidence = answer.confidence.as_deref();
    outputs.write(making, &Content { map: &answer.map, confidence, image, plan, inputs: &inputs })?;
    Ok(Report::new(pair, session.opened(), answer, errors, warnings, outputs.paths(making)))
}

/// The files that the outputs are made of.
fn sources(args: &MatchArgs) -> impl Iterator<Item = &Path> {
    [&args.left, &args.right].into_iter().flatten().chain(&args.outputs.making.calib).map(PathBuf::as_path)
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
