//! `bp match`: the disparity map of one's own pair.

use std::{fmt::Write as _, io::Write as _};

use bp_core::{
    Cut, Energy, Errors, MAX_LABELS, Matcher, Model, Plan, Schedule, Settings, Side, Size, Stage, StereoPair, Times,
};
use serde::Serialize;
use sha2::{Digest, Sha256};

use super::evaluate::{self, ErrorReport};
use crate::{
    args::{MatchArgs, PlanArgs},
    backends,
    failure::Failure,
    files::{MapFormat, PixelLimit, check_writable, hex, read_image, write_map, write_picture},
    interrupt, machine, record,
};

/// What `--json` prints.
#[derive(Serialize)]
struct Report {
    width: usize,
    height: usize,
    backend: &'static str,
    device: String,
    software_rasteriser: bool,
    profile: &'static str,
    algorithm: &'static str,
    labels: usize,
    min_disparity: i32,
    slope: u8,
    truncation: u8,
    grids: usize,
    steps_per_grid: u32,
    schedule: &'static str,
    message_start: &'static str,
    cut: Option<record::Cut>,
    message_updates: u64,
    planned_bytes: u64,
    allocated_bytes: u64,
    clock: record::Clock,
    stages: record::Stages,
    total_ms: f64,
    energy: record::Energy,
    errors: Option<ErrorReport>,
    messages_sha256: Option<String>,
    output: String,
}

/// A solved pair.
struct Solved {
    matcher: Matcher,
    times: Times,
    device: bp_core::DeviceInfo,
    energy: Energy,
    errors: Option<Errors>,
    messages_sha256: Option<String>,
}

/// Runs the command.
pub(crate) fn match_pair(args: &MatchArgs) -> Result<(), Failure> {
    MapFormat::of(&args.output)?;
    for path in std::iter::once(&args.output).chain(&args.picture) {
        check_writable(path)?;
    }
    let limit = PixelLimit::megapixels(args.max_megapixels);
    let (left, right) = (read_image(&args.left, limit)?, read_image(&args.right, limit)?);
    let pair = StereoPair::new(left, right)
        .map_err(|error| Failure::input(format!("{} and {}: {error}", args.left.display(), args.right.display())))?;
    let plan = plan(&args.plan, pair.size())?;
    if plan.model().labels() > pair.size().width {
        let (labels, width) = (plan.model().labels(), pair.size().width);
        eprintln!("warning: {labels} labels for images {width} pixels wide: the last ones match nowhere");
    }
    let solved = solve(args, &pair, plan)?;
    let map = solved.matcher.disparities();
    write_map(&args.output, &map)?;
    if let Some(picture) = &args.picture {
        write_picture(picture, &map)?;
    }
    let report = report(args, &solved);
    let mut out = std::io::stdout().lock();
    if args.json {
        serde_json::to_writer_pretty(&mut out, &report).map_err(std::io::Error::from)?;
        writeln!(out)?;
    } else {
        write!(out, "{}", text(&report, solved.errors.as_ref()))?;
    }
    Ok(())
}

/// The plan that the options describe for images of `size`.
fn plan(args: &PlanArgs, size: Size) -> Result<Plan, Failure> {
    check_options(args)?;
    let labels = args.labels.map_or_else(|| default_labels(size), usize::from);
    let model = Model::new(args.profile, labels)?.with_min_disparity(args.min_disparity)?;
    let slope = args.slope.unwrap_or(model.slope());
    let model = model.with_smoothness(slope, args.truncation.unwrap_or(model.truncation()))?;
    Ok(Plan::new(size, model, settings(args, size, labels))?)
}

/// Refuses options that contradict each other or would do nothing.
fn check_options(args: &PlanArgs) -> Result<(), Failure> {
    let algorithm = args.algorithm.name();
    let needs = |given: bool, holds: bool, option: &str, what: &str| {
        if given && !holds { Err(Failure::usage(format!("{option} needs {what}, not {algorithm}"))) } else { Ok(()) }
    };
    let coarse_to_fine = args.algorithm.is_coarse_to_fine();
    needs(args.grids.is_some(), coarse_to_fine, "--grids", "--algorithm cfbp or cfcsbp")?;
    needs(args.message_start.is_some(), coarse_to_fine, "--message-start", "--algorithm cfbp or cfcsbp")?;
    needs(args.z.is_some(), args.algorithm.divides_loops(), "--z", "--algorithm cfcsbp or ctcsbp")?;
    needs(args.seed_start.is_some(), args.algorithm.is_cut(), "--seed-start", "--algorithm ctbp or ctcsbp")?;
    let per_grid = args.half_steps.is_some() || args.grids.is_some();
    if args.z.is_some() && per_grid {
        return Err(Failure::usage(
            "--z divides loops that are counted by the algorithm, not by --grids or --half-steps",
        ));
    }
    if args.grids.is_some() && args.loops.is_none() && args.half_steps.is_none() {
        return Err(Failure::usage("--grids needs --loops or --half-steps, which then count on each grid"));
    }
    if args.half_steps.is_some() && args.schedule == Some(Schedule::Sync) {
        return Err(Failure::usage("--half-steps needs --schedule checkerboard"));
    }
    Ok(())
}

/// A quarter of the width, as OpenCV recommends for belief propagation, rounded up to a multiple of 16.
fn default_labels(size: Size) -> usize {
    size.width.div_ceil(4).next_multiple_of(16).min(MAX_LABELS)
}

fn settings(args: &PlanArgs, size: Size, labels: usize) -> Settings {
    let implied = if args.half_steps.is_some() { Schedule::Checkerboard } else { Schedule::Sync };
    let schedule = args.schedule.unwrap_or(implied);
    let loops = args.loops.unwrap_or(labels as u32);
    let mut settings = args.algorithm.settings(size, loops, args.z.unwrap_or(2), schedule);
    if let Some(grids) = args.grids {
        settings.grids = grids.into();
        settings.steps = loops * schedule.steps_per_loop();
    }
    if let Some(half_steps) = args.half_steps {
        settings.steps = half_steps;
    }
    if let Some(start) = args.message_start {
        settings.message_start = start;
    }
    let seed_start = args.seed_start.unwrap_or(true);
    settings.cut = settings.cut.map(|cut| Cut { seed_start, ..cut });
    settings
}

fn solve(args: &MatchArgs, pair: &StereoPair, plan: Plan) -> Result<Solved, Failure> {
    let backend = backends::by_name(&args.plan.backend)?;
    machine::check_memory(plan.bytes(), "fewer --labels or a smaller image need less")?;
    let truth = args.ground_truth.as_ref().map(|path| {
        let limit = PixelLimit::megapixels(args.max_megapixels);
        Ok::<_, Failure>((evaluate::read_truth(path, &args.truth, limit)?, path))
    });
    let truth = truth.transpose()?;
    if truth.is_none() && (args.truth.ground_truth_right.is_some() || args.truth.mask.is_some()) {
        return Err(Failure::usage("--ground-truth-right and --mask need --ground-truth"));
    }
    let device = backend.devices().into_iter().next();
    let device = device.ok_or_else(|| Failure::unavailable(format!("backend {} has no device", backend.name())))?;
    let mut matcher = Matcher::new(backend.open(0)?.as_ref(), plan)?;
    let bar = interrupt::ProgressBar::new(matcher.plan().message_updates());
    let times = matcher.solve_observed(pair, &mut |progress| bar.update(progress.done))?;
    bar.finish();
    let energy = Energy::of(pair, matcher.plan().model(), matcher.labels())?;
    let errors = truth.map(|(truth, path)| evaluate::measure(&matcher.disparities(), &truth, &args.left, path));
    let errors = errors.transpose()?;
    let messages_sha256 = args.messages_hash.then(|| hash_messages(&mut matcher)).transpose()?;
    Ok(Solved { matcher, times, device, energy, errors, messages_sha256 })
}

fn hash_messages(matcher: &mut Matcher) -> Result<String, Failure> {
    let mut hash = Sha256::new();
    for side in Side::ALL {
        hash.update(matcher.messages(side)?);
    }
    Ok(hex(&hash.finalize()))
}

fn report(args: &MatchArgs, solved: &Solved) -> Report {
    let plan = solved.matcher.plan();
    let (model, settings, size) = (plan.model(), plan.settings(), plan.image_size());
    Report {
        width: size.width,
        height: size.height,
        backend: backends::by_name(&args.plan.backend).map_or("", bp_core::Backend::name),
        device: solved.device.name.clone(),
        software_rasteriser: solved.device.software_rasteriser,
        profile: model.profile().name(),
        algorithm: args.plan.algorithm.name(),
        labels: model.labels(),
        min_disparity: model.min_disparity(),
        slope: model.slope(),
        truncation: model.truncation(),
        grids: settings.grids,
        steps_per_grid: settings.steps,
        schedule: settings.schedule.name(),
        message_start: settings.message_start.name(),
        cut: settings.cut.map(|Cut { x, y, seed_start }| record::Cut { x, y, seed_start }),
        message_updates: plan.message_updates(),
        planned_bytes: plan.bytes(),
        allocated_bytes: solved.matcher.allocated_bytes(),
        clock: record::Clock::Wall,
        stages: (&solved.times).into(),
        total_ms: 1000.0 * solved.times.total.as_secs_f64(),
        energy: solved.energy.into(),
        errors: solved.errors.map(Into::into),
        messages_sha256: solved.messages_sha256.clone(),
        output: args.output.display().to_string(),
    }
}

fn text(report: &Report, errors: Option<&Errors>) -> String {
    let mut text = String::new();
    let step = if report.schedule == "sync" { "loops" } else { "half-steps" };
    let mebibytes = |bytes: u64| bytes as f64 / f64::from(1 << 20);
    let stages = [
        report.stages.match_cost_ms,
        report.stages.coarsen_ms,
        report.stages.refine_ms,
        report.stages.update_messages_ms,
        report.stages.select_labels_ms,
    ];
    let Report { width, height, labels, min_disparity, algorithm, profile, grids, steps_per_grid, .. } = report;
    let last = min_disparity + *labels as i32 - 1;
    let _ = writeln!(text, "{:<10}{width}x{height} pixels, {labels} labels ({min_disparity} to {last} px)", "pair");
    let _ = writeln!(
        text,
        "{:<10}{algorithm}, profile {profile}, {grids} grids x {steps_per_grid} {step} ({}), on {}: {}",
        "plan", report.schedule, report.backend, report.device
    );
    let _ = writeln!(text, "{:<10}{:.1} ms in all", "time", report.total_ms);
    for (stage, ms) in Stage::ALL.into_iter().zip(stages) {
        let _ = writeln!(text, "{:<10}  {:<16}{ms:>10.1} ms", "", stage.name());
    }
    let (planned, allocated) = (mebibytes(report.planned_bytes), mebibytes(report.allocated_bytes));
    let _ = writeln!(text, "{:<10}{allocated:.1} MiB allocated, {planned:.1} MiB predicted", "memory");
    let record::Energy { total, data, smoothness } = report.energy;
    let _ = writeln!(text, "{:<10}{total} = {data} data + {smoothness} smoothness", "energy");
    if let Some(hash) = &report.messages_sha256 {
        let _ = writeln!(text, "{:<10}sha256 {hash}", "messages");
    }
    if let Some(errors) = errors {
        text += &evaluate::error_table(errors);
    }
    let _ = writeln!(text, "{:<10}{}", "written", report.output);
    text
}
