//! `bp match`: the disparity map of one's own pair.

use std::{fmt::Write as _, io::Write as _, path::Path};

use bp_core::{Energy, Errors, GroundTruth, Matcher, Plan, Side, Size, Stage, StereoPair, Times};
use serde::Serialize;
use sha2::{Digest, Sha256};

use super::{
    evaluate::{self, ErrorReport},
    plan, print_json,
};
use crate::{
    args::MatchArgs,
    backends,
    failure::Failure,
    files::{
        PixelLimit, check_distinct, check_png, check_range, check_writable, hex, read_image, write_map, write_picture,
    },
    interrupt, record, tell, threads,
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
    /// Of every match, in order.
    samples_ms: Vec<f64>,
    /// The median of these, and the stages of that match.
    total_ms: f64,
    clocks: Vec<record::Clocked>,
    energy: record::Energy,
    errors: Option<ErrorReport>,
    messages_sha256: Option<String>,
    output: String,
}

/// Runs the command.
pub(crate) fn match_pair(args: &MatchArgs) -> Result<(), Failure> {
    plan::check_options(&args.plan)?;
    let truth_options =
        args.truth.ground_truth_right.is_some() || args.truth.mask.is_some() || args.truth.scale.is_some();
    if args.ground_truth.is_none() && truth_options {
        return Err(Failure::usage("--ground-truth-right, --mask and --scale need --ground-truth"));
    }
    check_paths(args)?;
    let limit = PixelLimit::megapixels(args.max_megapixels);
    let pair = read_pair(args, limit)?;
    let plan = plan::plan(&args.plan, pair.size())?;
    let model = plan.model();
    check_range(&args.output, model.disparity(0), model.disparity(model.labels() as u16 - 1))?;
    if model.labels() > pair.size().width {
        let (labels, width) = (model.labels(), pair.size().width);
        tell(&format!("warning: {labels} labels for images {width} pixels wide: the last ones match nowhere"));
    }
    let matches_any = |label| (model.disparity(label).unsigned_abs() as usize) < pair.size().width;
    if !(0..model.labels() as u16).any(matches_any) {
        tell("warning: with this --min-disparity no label matches anything inside the right image");
    }
    let truth = args.ground_truth.as_deref().map(|path| read_truth(args, path, pair.size(), limit)).transpose()?;
    interrupt::listen()?;
    let report = threads::run_on(args.plan.threads, || solve(args, &pair, plan, truth.as_ref()))?;
    if args.json { print_json(&report) } else { Ok(write!(std::io::stdout(), "{}", text(&report))?) }
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

/// Matches the pair and writes its map.
fn solve(args: &MatchArgs, pair: &StereoPair, plan: Plan, truth: Option<&GroundTruth>) -> Result<Report, Failure> {
    let opened = backends::open(&args.plan.backend, args.plan.device.as_deref())?;
    threads::check(args.plan.threads, &[&opened])?;
    let plan = plan::fitting(args, plan, &opened)?;
    let settings = plan::recorded_settings(&args.plan, &plan, &opened);
    let mut matcher = Matcher::new(opened.device.as_ref(), plan)?;
    let samples = take_samples(&mut matcher, pair, args.repeat)?;
    let median = median(&samples);
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
        samples_ms: samples.iter().map(total_ms).collect(),
        total_ms: total_ms(&median),
        clocks: record::clocks(&median),
        energy: energy.into(),
        errors: errors.map(Into::into),
        messages_sha256: args.messages_hash.then(|| hash_messages(&mut matcher)).transpose()?,
        output: args.output.display().to_string(),
    })
}

/// Matches the pair so many times.
fn take_samples(matcher: &mut Matcher, pair: &StereoPair, repeat: u32) -> Result<Vec<Times>, Failure> {
    let updates = matcher.plan().message_updates();
    let bar = interrupt::ProgressBar::new(updates.saturating_mul(repeat.into()));
    let mut samples = Vec::new();
    for index in 0..u64::from(repeat) {
        let before = updates.saturating_mul(index);
        samples.push(matcher.solve_observed(pair, &mut |progress| bar.update(before.saturating_add(progress.done)))?);
    }
    bar.finish();
    Ok(samples)
}

/// The sample of median total; of an even number, the lower one of the two in the middle.
fn median(samples: &[Times]) -> Times {
    let mut sorted = samples.to_vec();
    sorted.sort_by_key(|times| times.total);
    sorted[(samples.len() - 1) / 2]
}

fn total_ms(times: &Times) -> f64 {
    1000.0 * times.total.as_secs_f64()
}

fn hash_messages(matcher: &mut Matcher) -> Result<String, Failure> {
    let mut hash = Sha256::new();
    for side in Side::ALL {
        hash.update(matcher.messages(side)?);
    }
    Ok(hex(&hash.finalize()))
}

/// The range of several samples.
fn spread(samples_ms: &[f64]) -> String {
    let low = samples_ms.iter().copied().fold(f64::INFINITY, f64::min);
    let high = samples_ms.iter().copied().fold(0.0, f64::max);
    let count = samples_ms.len();
    if count > 1 { format!(", median of {count} from {low:.1} to {high:.1} ms") } else { String::new() }
}

fn text(report: &Report) -> String {
    let mut text = String::new();
    let Report { width, height, settings, .. } = report;
    let record::Settings { labels, min_disparity, algorithm, profile, grids, steps_per_grid, schedule, .. } = settings;
    let last = min_disparity + *labels as i32 - 1;
    let _ = writeln!(text, "{:<10}{width}x{height} pixels, {labels} labels ({min_disparity} to {last} px)", "pair");
    let steps = if schedule == "checkerboard" { "half-steps" } else { "loops" };
    let plan = format!("{algorithm}, profile {profile}, {grids} grids x {steps_per_grid} {steps} ({schedule})");
    let software = if report.device.software_rasteriser { " (software rasteriser)" } else { "" };
    let _ = writeln!(text, "{:<10}{plan}, on {}: {}{software}", "plan", report.backend, report.device.name);
    let _ = writeln!(text, "{:<10}{:.1} ms in all{}", "time", report.total_ms, spread(&report.samples_ms));
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
