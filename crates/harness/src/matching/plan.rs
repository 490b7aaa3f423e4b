//! What the options of `bp match` ask to run.

use bp_core::{Algorithm, Cut, MAX_LABELS, Model, Plan, Schedule, Settings, Size};

use crate::{
    args::{MatchArgs, PlanArgs},
    backends::Opened,
    failure::Failure,
    machine, record, tell,
};

/// The algorithms that take loops of the thesis's schedules, as messages name them.
const THESIS: &str = "--algorithm bp, cfbp, cfcsbp, ctbp or ctcsbp";

/// A change of the default plan that makes it smaller, and the option that stands for it.
type Smaller = (&'static str, fn(Settings) -> Settings);

/// In the order in which they are tried: each is less accurate than the one before. More grids than two would need
/// hardly less than all.
const SMALLER: [Smaller; 3] = [
    ("--coarse-clip off", |settings| Settings { coarse_clip: false, ..settings }),
    ("--grids 2", |settings| Settings { grids: 2, ..settings }),
    ("--grids 1", |settings| Settings { grids: 1, ..settings }),
];

/// The plan that the options describe for images of `size`.
pub(crate) fn plan(args: &PlanArgs, size: Size) -> Result<Plan, Failure> {
    let labels = args.labels.map_or_else(|| default_labels(size), usize::from);
    let model = Model::new(args.profile, labels)?.with_min_disparity(args.min_disparity)?;
    let slope = args.slope.unwrap_or(model.slope());
    let model = model.with_smoothness(slope, args.truncation.unwrap_or(model.truncation()))?;
    let model = model.with_weak_edges(args.edge_threshold);
    Ok(Plan::new(size, model, settings(args, size, labels))?)
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

/// A quarter of the width, as OpenCV recommends for belief propagation, rounded up to a multiple of 16.
fn default_labels(size: Size) -> usize {
    size.width.div_ceil(4).next_multiple_of(16).min(MAX_LABELS)
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

/// The settings as records tell them.
pub(crate) fn recorded_settings(args: &PlanArgs, plan: &Plan, opened: &Opened) -> record::Settings {
    let own = counts_on_each_grid(args);
    let k = (!own).then(|| loops(args, plan.model().labels()));
    let z = (!own && args.algorithm().divides_loops()).then(|| args.z.unwrap_or(2));
    record::Settings::new(plan, Some(opened.device.as_ref()), args.algorithm(), (k, z))
}

/// The plan, if it fits into the memory that there is and that `--max-memory` allows. In place of the default plan, the
/// first smaller one that is allowed runs, and standard error tells so.
pub(crate) fn fitting(args: &MatchArgs, plan: Plan, opened: &Opened) -> Result<Plan, Failure> {
    let mut plans = vec![plan];
    if !is_shaped(&args.plan) {
        let smaller =
            |(_, change): &Smaller| Plan::new(plans[0].image_size(), *plans[0].model(), change(*plans[0].settings()));
        let smaller = SMALLER.iter().map(smaller).collect::<Result<Vec<_>, _>>()?;
        plans.extend(smaller);
    }
    let bytes: Vec<u64> = plans.iter().map(|plan| opened.device.planned_bytes(plan)).collect();
    let fits = |&needed: &u64| args.max_memory.is_none_or(|allowed| needed <= allowed.as_u64());
    let chosen = bytes.iter().position(fits).unwrap_or(plans.len() - 1);
    let advice = match plans[chosen].settings().schedule {
        Schedule::Sweep => "fewer --labels or smaller images need less",
        _ => "fewer --labels, smaller images or --algorithm sweep need less",
    };
    machine::check_memory(opened.info.kind, bytes[chosen], args.max_memory, advice)?;
    if chosen > 0 {
        let (needed, takes, option) = (bytes[0], bytes[chosen], SMALLER[chosen - 1].0);
        let instead = format!("matching with {option}, which takes {takes} and is less accurate");
        tell(&format!("--max-memory: the default plan needs {needed} bytes; {instead}"));
    }
    Ok(plans.swap_remove(chosen))
}

/// Whether an option gives the plan its shape; those that need an algorithm other than the default need `--algorithm`.
fn is_shaped(args: &PlanArgs) -> bool {
    let counts = args.grids.is_some() || args.loops.is_some();
    counts || args.algorithm.is_some() || args.schedule.is_some() || args.coarse_clip.is_some()
}
