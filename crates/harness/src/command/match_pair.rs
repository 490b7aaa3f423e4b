//! `bp match`: the disparity map of one's own pair.

use std::{fmt::Write as _, io::Write as _, path::Path};

use bp_core::{
    Algorithm, Cut, Energy, Errors, GroundTruth, MAX_LABELS, Matcher, Model, Plan, Schedule, Settings, Side, Size,
    Stage, StereoPair,
};
use serde::Serialize;
use sha2::{Digest, Sha256};

use super::evaluate::{self, ErrorReport};
use crate::{
    args::{MatchArgs, PlanArgs},
    backends::{self, Opened},
    failure::Failure,
    files::{
        PixelLimit, check_distinct, check_png, check_range, check_writable, hex, read_image, write_map, write_picture,
    },
    interrupt, machine, record, tell,
};

/// What `--json` prints.
#[derive(Serialize)]
struct Report {
    width: usize,
    height: usize,
    backend: String,
    device: record::Device,
    settings: record::Settings,
    allocated_bytes: u64,
    total_ms: f64,
    clocks: Vec<record::Clocked>,
    energy: record::Energy,
    errors: Option<ErrorReport>,
    messages_sha256: Option<String>,
    output: String,
}

/// Runs the command.
pub(crate) fn match_pair(args: &MatchArgs) -> Result<(), Failure> {
    check_options(&args.plan)?;
    let truth_options =
        args.truth.ground_truth_right.is_some() || args.truth.mask.is_some() || args.truth.scale.is_some();
    if args.ground_truth.is_none() && truth_options {
        return Err(Failure::usage("--ground-truth-right, --mask and --scale need --ground-truth"));
    }
    check_paths(args)?;
    let limit = PixelLimit::megapixels(args.max_megapixels);
    let pair = read_pair(args, limit)?;
    let plan = plan(&args.plan, pair.size())?;
    let model = plan.model();
    check_range(&args.output, model.disparity(0), model.disparity(model.labels() as u16 - 1))?;
    if model.labels() > pair.size().width {
        let (labels, width) = (model.labels(), pair.size().width);
        tell(&format!("warning: {labels} labels for images {width} pixels wide: the last ones match nowhere"));
    }
    let matches_any =
        |label| (0..pair.size().width).any(|x| model.matching_column(x, label, pair.size().width).is_some());
    if !(0..model.labels() as u16).any(matches_any) {
        tell("warning: with this --min-disparity no label matches anything inside the right image");
    }
    let truth = args.ground_truth.as_deref().map(|path| read_truth(args, path, pair.size(), limit)).transpose()?;
    interrupt::listen()?;
    let report = solve(args, &pair, plan, truth.as_ref())?;
    let mut out = std::io::stdout().lock();
    if args.json {
        serde_json::to_writer_pretty(&mut out, &report).map_err(std::io::Error::from)?;
        writeln!(out)?;
    } else {
        write!(out, "{}", text(&report))?;
    }
    Ok(())
}

fn check_paths(args: &MatchArgs) -> Result<(), Failure> {
    let outputs = || std::iter::once(&args.output).chain(&args.picture);
    let inputs = [&args.left, &args.right].into_iter();
    let truths = [&args.ground_truth, &args.truth.ground_truth_right, &args.truth.mask].into_iter().flatten();
    for output in outputs() {
        check_writable(output)?;
        for input in inputs.clone().chain(truths.clone()) {
            check_distinct(input, output)?;
        }
    }
    if let Some(picture) = &args.picture {
        check_png(picture)?;
        check_distinct(&args.output, picture)?;
    }
    Ok(())
}

fn read_pair(args: &MatchArgs, limit: PixelLimit) -> Result<StereoPair, Failure> {
    let (left, right) = (read_image(&args.left, limit)?, read_image(&args.right, limit)?);
    StereoPair::new(left, right).map_err(|error| {
        let (left, right) = (args.left.display(), args.right.display());
        Failure::input(format!("{left} and {right}: {error}"))
    })
}

fn read_truth(args: &MatchArgs, path: &Path, size: Size, limit: PixelLimit) -> Result<GroundTruth, Failure> {
    let truth = evaluate::read_truth(path, &args.truth, limit)?;
    let found = truth.disparities().size();
    if found == size {
        return Ok(truth);
    }
    Err(Failure::input(format!("{}: {found} pixels where the images have {size}", path.display())))
}

/// The plan that the options describe for images of `size`.
fn plan(args: &PlanArgs, size: Size) -> Result<Plan, Failure> {
    let labels = args.labels.map_or_else(|| default_labels(size), usize::from);
    let model = Model::new(args.profile, labels)?.with_min_disparity(args.min_disparity)?;
    let slope = args.slope.unwrap_or(model.slope());
    let model = model.with_smoothness(slope, args.truncation.unwrap_or(model.truncation()))?;
    Ok(Plan::new(size, model, settings(args, size, labels))?)
}

/// Refuses options that contradict each other or would do nothing.
fn check_options(args: &PlanArgs) -> Result<(), Failure> {
    check_algorithm_options(args)?;
    if args.z.is_some() && counts_on_each_grid(args) {
        return Err(Failure::usage(
            "--z divides loops that the algorithm counts, not those of --grids or --half-steps",
        ));
    }
    let counted = args.loops.is_some() || args.half_steps.is_some() || args.algorithm == Algorithm::Sweep;
    if args.grids.is_some() && !counted {
        return Err(Failure::usage("--grids needs --loops or --half-steps, which then count on each grid"));
    }
    if args.half_steps.is_some() && args.schedule.is_some_and(|schedule| schedule != Schedule::Checkerboard) {
        return Err(Failure::usage("--half-steps needs --schedule checkerboard"));
    }
    Ok(())
}

/// Refuses options that are other algorithms'.
fn check_algorithm_options(args: &PlanArgs) -> Result<(), Failure> {
    let algorithm = args.algorithm.name();
    let needs = |given: bool, holds: bool, option: &str, what: &str| {
        if given && !holds { Err(Failure::usage(format!("{option} needs {what}, not {algorithm}"))) } else { Ok(()) }
    };
    let coarse_to_fine = args.algorithm.is_coarse_to_fine();
    let sweep = args.algorithm == Algorithm::Sweep;
    needs(args.grids.is_some(), coarse_to_fine, "--grids", "--algorithm cfbp, cfcsbp or sweep")?;
    needs(args.coarse_clip.is_some(), coarse_to_fine, "--coarse-clip", "--algorithm cfbp, cfcsbp or sweep")?;
    needs(args.message_start.is_some(), coarse_to_fine && !sweep, "--message-start", "--algorithm cfbp or cfcsbp")?;
    needs(args.half_steps.is_some(), !sweep, "--half-steps", "an algorithm of the thesis")?;
    let other_schedule = args.schedule.is_some_and(|schedule| schedule != Schedule::Sweep);
    needs(other_schedule, !sweep, "--schedule sync or checkerboard", "an algorithm of the thesis")?;
    needs(args.z.is_some(), args.algorithm.divides_loops(), "--z", "--algorithm cfcsbp or ctcsbp")?;
    needs(args.seed_start.is_some(), args.algorithm.is_cut(), "--seed-start", "--algorithm ctbp or ctcsbp")
}

/// Whether loops or half-steps are counted on each grid and divided by nothing.
fn counts_on_each_grid(args: &PlanArgs) -> bool {
    args.grids.is_some() || args.half_steps.is_some() || args.algorithm == Algorithm::Sweep
}

/// A quarter of the width, as OpenCV recommends for belief propagation, rounded up to a multiple of 16.
fn default_labels(size: Size) -> usize {
    size.width.div_ceil(4).next_multiple_of(16).min(MAX_LABELS)
}

fn loops(args: &PlanArgs, labels: usize) -> u32 {
    args.loops.unwrap_or(if args.algorithm == Algorithm::Sweep { 1 } else { labels as u32 })
}

fn settings(args: &PlanArgs, size: Size, labels: usize) -> Settings {
    let implied = if args.half_steps.is_some() { Schedule::Checkerboard } else { Schedule::Sync };
    let schedule = args.schedule.unwrap_or(implied);
    let loops = loops(args, labels);
    let mut settings = args.algorithm.settings(size, loops, args.z.unwrap_or(2), schedule);
    if let Some(grids) = args.grids {
        settings.grids = grids.into();
    }
    if counts_on_each_grid(args) {
        settings.steps = args.half_steps.unwrap_or(loops * settings.schedule.steps_per_loop());
    }
    settings.message_start = args.message_start.unwrap_or(settings.message_start);
    settings.coarse_clip = args.coarse_clip.unwrap_or(settings.coarse_clip);
    let seed_start = args.seed_start.unwrap_or(true);
    settings.cut = settings.cut.map(|cut| Cut { seed_start, ..cut });
    settings
}

/// The settings as records tell them.
fn recorded_settings(args: &PlanArgs, plan: &Plan, opened: &Opened) -> record::Settings {
    let own = counts_on_each_grid(args);
    let k = (!own).then(|| loops(args, plan.model().labels()));
    let z = (!own && args.algorithm.divides_loops()).then(|| args.z.unwrap_or(2));
    record::Settings::new(plan, opened.device.as_ref(), args.algorithm, (k, z))
}

/// Matches the pair and writes its map.
fn solve(args: &MatchArgs, pair: &StereoPair, plan: Plan, truth: Option<&GroundTruth>) -> Result<Report, Failure> {
    let opened = backends::open(&args.plan.backend)?;
    let settings = recorded_settings(&args.plan, &plan, &opened);
    machine::check_memory(settings.planned_bytes, "fewer --labels or smaller images need less")?;
    let mut matcher = Matcher::new(opened.device.as_ref(), plan)?;
    let bar = interrupt::ProgressBar::new(settings.message_updates);
    let times = matcher.solve_observed(pair, &mut |progress| bar.update(progress.done))?;
    bar.finish();
    let map = matcher.disparities();
    let errors: Option<Errors> = truth.map(|truth| truth.errors(&map)).transpose()?;
    let energy = Energy::of(pair, matcher.plan().model(), matcher.labels())?;
    interrupt::check()?;
    write_map(&args.output, &map)?;
    if let Some(picture) = &args.picture {
        write_picture(picture, &map)?;
    }
    Ok(Report {
        width: pair.size().width,
        height: pair.size().height,
        backend: opened.name,
        device: (&opened.info).into(),
        settings,
        allocated_bytes: matcher.allocated_bytes(),
        total_ms: 1000.0 * times.total.as_secs_f64(),
        clocks: record::clocks(&times),
        energy: energy.into(),
        errors: errors.map(Into::into),
        messages_sha256: args.messages_hash.then(|| hash_messages(&mut matcher)).transpose()?,
        output: args.output.display().to_string(),
    })
}

fn hash_messages(matcher: &mut Matcher) -> Result<String, Failure> {
    let mut hash = Sha256::new();
    for side in Side::ALL {
        hash.update(matcher.messages(side)?);
    }
    Ok(hex(&hash.finalize()))
}

fn text(report: &Report) -> String {
    let mut text = String::new();
    let Report { width, height, settings, .. } = report;
    let record::Settings { labels, min_disparity, algorithm, profile, grids, steps_per_grid, schedule, .. } = settings;
    let last = min_disparity + *labels as i32 - 1;
    let _ = writeln!(text, "{:<10}{width}x{height} pixels, {labels} labels ({min_disparity} to {last} px)", "pair");
    let steps = if schedule == "checkerboard" { "half-steps" } else { "loops" };
    let plan = format!("{algorithm}, profile {profile}, {grids} grids x {steps_per_grid} {steps} ({schedule})");
    let _ = writeln!(text, "{:<10}{plan}, on {}: {}", "plan", report.backend, report.device.name);
    let _ = writeln!(text, "{:<10}{:.1} ms in all", "time", report.total_ms);
    for record::Clocked { clock, stages } in &report.clocks {
        let _ = writeln!(text, "{:<12}{clock:?} clock", "");
        for (stage, ms) in Stage::ALL.into_iter().zip(stages.in_order()) {
            let _ = writeln!(text, "{:<14}{:<16}{ms:>10.1} ms", "", stage.name());
        }
    }
    let mebibytes = |bytes: u64| bytes as f64 / f64::from(1 << 20);
    let (planned, allocated) = (mebibytes(settings.planned_bytes), mebibytes(report.allocated_bytes));
    let _ = writeln!(text, "{:<10}{allocated:.1} MiB allocated, {planned:.1} MiB predicted", "memory");
    let record::Energy { total, data, smoothness } = report.energy;
    let _ = writeln!(text, "{:<10}{total} = {data} data + {smoothness} smoothness", "energy");
    if let Some(hash) = &report.messages_sha256 {
        let _ = writeln!(text, "{:<10}sha256 {hash}", "messages");
    }
    if let Some(errors) = &report.errors {
        text += &evaluate::error_table(errors);
    }
    let _ = writeln!(text, "{:<10}{}", "written", report.output);
    text
}
