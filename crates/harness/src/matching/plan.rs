//! What the options of `bp match` ask to run.

use bp_core::{Algorithm, Cut, Model, Plan, Schedule, Settings, Size, Tiling, survey::DisparityRange};

use crate::{args::PlanArgs, backends::Opened, failure::Failure, record};

/// The algorithms that take loops of the thesis's schedules, as messages name them.
const THESIS: &str = "--algorithm bp, cfbp, cfcsbp, ctbp or ctcsbp";

/// The plan that the options describe for images of `size`, with the labels of `range`.
pub(crate) fn plan(args: &PlanArgs, size: Size, range: DisparityRange) -> Result<Plan, Failure> {
    let model = Model::new(args.profile, range.labels)?.with_min_disparity(range.min_disparity)?;
    let slope = args.slope.unwrap_or(model.slope());
    let model = model.with_smoothness(slope, args.truncation.unwrap_or(model.truncation()))?;
    let model = model.with_weak_edges(args.edge_threshold);
    Ok(Plan::new(size, model, settings(args, size, range.labels))?)
}

/// Refuses options that contradict each other or would do nothing.
pub(crate) fn check_options(args: &PlanArgs) -> Result<(), Failure> {
    check_algorithm_options(args)?;
    if args.z.is_some() && counts_on_each_grid(args) {
        return Err(Failure::usage(
            "--z divides loops that the algorithm counts, not those of --grids or --half-steps",
        ));
    }
    let counted = args.loops.is_some() || args.half_steps.is_some() || args.algorithm() == Algorithm::Sweep;
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
    let algorithm = args.algorithm().name();
    let needs = |given: bool, holds: bool, option: &str, what: &str| {
        if given && !holds { Err(Failure::usage(format!("{option} needs {what}, not {algorithm}"))) } else { Ok(()) }
    };
    let coarse_to_fine = args.algorithm().is_coarse_to_fine();
    let sweep = args.algorithm() == Algorithm::Sweep;
    needs(args.grids.is_some(), coarse_to_fine, "--grids", "--algorithm cfbp, cfcsbp or sweep")?;
    needs(args.coarse_clip.is_some(), coarse_to_fine, "--coarse-clip", "--algorithm cfbp, cfcsbp or sweep")?;
    needs(args.message_start.is_some(), coarse_to_fine && !sweep, "--message-start", "--algorithm cfbp or cfcsbp")?;
    needs(args.half_steps.is_some(), !sweep, "--half-steps", THESIS)?;
    let other_schedule = args.schedule.is_some_and(|schedule| schedule != Schedule::Sweep);
    needs(other_schedule, !sweep, "--schedule sync or checkerboard", THESIS)?;
    needs(args.z.is_some(), args.algorithm().divides_loops(), "--z", "--algorithm cfcsbp or ctcsbp")?;
    needs(args.seed_start.is_some(), args.algorithm().is_cut(), "--seed-start", "--algorithm ctbp or ctcsbp")
}

/// Whether loops or half-steps are counted on each grid and divided by nothing.
fn counts_on_each_grid(args: &PlanArgs) -> bool {
    args.grids.is_some() || args.half_steps.is_some() || args.algorithm() == Algorithm::Sweep
}

fn loops(args: &PlanArgs, labels: usize) -> u32 {
    args.loops.unwrap_or(if args.algorithm() == Algorithm::Sweep { 1 } else { labels as u32 })
}

fn settings(args: &PlanArgs, size: Size, labels: usize) -> Settings {
    let implied = if args.half_steps.is_some() { Schedule::Checkerboard } else { Schedule::Sync };
    let schedule = args.schedule.unwrap_or(implied);
    let loops = loops(args, labels);
    let mut settings = args.algorithm().settings(size, loops, args.z.unwrap_or(2), schedule);
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

/// The settings as records tell them, of a plan that is tiled like that.
pub(crate) fn recorded_settings(
    args: &PlanArgs,
    tiling: &Tiling,
    opened: &Opened,
) -> Result<record::Settings, Failure> {
    let (own, plan) = (counts_on_each_grid(args), tiling.plan());
    let k = (!own).then(|| loops(args, plan.model().labels()));
    let z = (!own && args.algorithm().divides_loops()).then(|| args.z.unwrap_or(2));
    let device = opened.device.as_ref();
    Ok(record::Settings {
        k,
        z,
        message_updates: tiling.message_updates(),
        planned_bytes: tiling.bytes(&|plan| Ok(device.planned_bytes(plan)))?,
        ..record::Settings::new(plan, Some(device), args.algorithm())
    })
}
