//! The guarded speed-ups: which runner and plan over which.

use bp_core::Stage;

use crate::record::Sample;

/// The thesis's plans that are compared with its first, plain BP.
const AGAINST_BP: [&str; 4] = ["cfbp", "cfcsbp", "ctbp", "ctcsbp"];

/// The fraction of a speed-up that may be lost if both sides run on one CPU thread. Noise and memory placement account
/// for a few percent.
const ONE_THREAD: f64 = 0.12;

/// The same for a GPU.
const GPU: f64 = 0.2;

/// The same for what needs all cores, or caches that other machines of the same host use as well: all threads over one,
/// software rasterisers, kernels that mostly copy. Two runs on machines with the same processor differed by as much.
const SHARED: f64 = 0.35;

/// A plan on a runner.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Entrant {
    /// Name of the runner.
    pub(super) runner: String,
    /// Name of the plan, as in the tables.
    pub(super) plan: &'static str,
}

/// The part of a solve that is timed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// From images to labels, by the wall clock.
    Total,
    /// Initial messages and their updates.
    MessagePassing,
    /// A kernel.
    Kernel(Stage),
}

/// A speed-up: the time of `over` divided by the time of `of`.
#[derive(Clone, Debug)]
pub(super) struct Guarded {
    pub(super) of: Entrant,
    pub(super) over: Entrant,
    pub(super) part: Part,
    /// The fraction of it that may be lost, see [`ONE_THREAD`].
    pub(super) tolerance: f64,
}

/// A device that does not use our threads.
#[derive(Clone, Debug)]
pub(super) struct Device {
    /// Name of its runner.
    pub(super) runner: String,
    /// Whether it is a driver that runs on the CPU, with threads of its own.
    pub(super) is_software: bool,
}

/// The runners, by name.
#[derive(Clone, Debug)]
pub(super) struct Lineup {
    /// The reference, whose times are taken as given.
    pub(super) reference: String,
    /// The fast CPU backend on one thread.
    pub(super) one_thread: String,
    /// The same on all threads, if there are several.
    pub(super) all_threads: Option<String>,
    pub(super) devices: Vec<Device>,
}

/// Everything that is guarded.
pub(super) fn all(lineup: &Lineup) -> Vec<Guarded> {
    let Lineup { reference, one_thread, all_threads, devices } = lineup;
    let against_bp = |runner: &String, plan, part| between((runner, plan), (runner, "bp"), part, ONE_THREAD);
    let mut all: Vec<_> = AGAINST_BP.map(|plan| against_bp(reference, plan, Part::MessagePassing)).into();
    let ours = ["hierarchy", "sweep"];
    all.extend(AGAINST_BP.into_iter().chain(ours).map(|plan| against_bp(one_thread, plan, Part::Total)));
    let kernel = |runner, plan, stage: Stage, tolerance| {
        between((runner, plan), (reference, plan), Part::Kernel(stage), tolerance)
    };
    // This backend refines while it updates messages.
    let stages = Stage::ALL.into_iter().filter(|&stage| stage != Stage::Refine);
    all.extend(stages.map(|stage| kernel(one_thread, "hierarchy", stage, on_one_thread(stage))));
    all.push(kernel(one_thread, "bp", Stage::UpdateMessages, ONE_THREAD));
    all.push(between((one_thread, "sweep"), (reference, "sweep"), Part::Total, ONE_THREAD));
    if let Some(all_threads) = all_threads {
        all.extend(ours.map(|plan| between((all_threads, plan), (one_thread, plan), Part::Total, SHARED)));
    }
    for Device { runner: device, is_software } in devices {
        let tolerance = if *is_software { SHARED } else { GPU };
        let stages = [Stage::MatchCost, Stage::UpdateMessages];
        all.extend(stages.map(|stage| kernel(device, "hierarchy", stage, tolerance)));
        all.push(kernel(device, "bp", Stage::UpdateMessages, tolerance));
        all.push(between((device, "hierarchy"), (reference, "hierarchy"), Part::Total, tolerance));
    }
    all
}

/// The tolerance of a kernel of the fast CPU backend on one thread. Two of them mostly copy.
fn on_one_thread(stage: Stage) -> f64 {
    if matches!(stage, Stage::Coarsen | Stage::SelectLabels) { SHARED } else { ONE_THREAD }
}

fn between(
    (of, plan): (&String, &'static str),
    (over, other): (&String, &'static str),
    part: Part,
    tolerance: f64,
) -> Guarded {
    let entrant = |runner: &String, plan| Entrant { runner: runner.clone(), plan };
    Guarded { of: entrant(of, plan), over: entrant(over, other), part, tolerance }
}

impl Guarded {
    /// Its name in tables and baselines.
    pub(super) fn name(&self) -> String {
        let Self { of, over, part, .. } = self;
        let what = match part {
            Part::Total => "total",
            Part::MessagePassing => "message passing",
            Part::Kernel(stage) => stage.name(),
        };
        if of.runner == over.runner {
            format!("{}: {} over {}, {what}", of.runner, of.plan, over.plan)
        } else {
            format!("{} over {}: {}, {what}", of.runner, over.runner, of.plan)
        }
    }
}

impl Part {
    /// This part of a solve, in milliseconds.
    pub(super) fn ms(self, sample: &Sample) -> f64 {
        match self {
            Self::Total => sample.total_ms,
            Self::MessagePassing => sample.message_passing_ms(),
            Self::Kernel(stage) => sample.stages_ms()[stage as usize],
        }
    }
}
