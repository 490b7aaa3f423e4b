//! The plans that run on every scene.

use bp_core::{
    Algorithm, DeviceInfo, DeviceKind, Error, LabelSet, Model, Parting, Plan, Profile, Schedule, Settings, Size,
};

use crate::record::Arrangement;

/// The default of Z'' and Z''''. The digit is missing in the thesis; this is the most likely one.
const Z: u32 = 2;

/// A plan of the tables.
#[derive(Clone, Copy, Debug)]
pub struct Planned {
    /// Its name in records.
    pub name: &'static str,
    /// Its algorithm.
    pub algorithm: Algorithm,
    profile: Profile,
    /// Divisor of the number of iterations.
    pub z: Option<u32>,
    schedule: Schedule,
    /// Number of grids and of steps on each, instead of the algorithm's own.
    fixed: Option<(u32, u32)>,
    /// Whether it uses label sets, from [`LabelSet::WORTHWHILE`] labels on.
    label_sets: bool,
    /// How it uses the workers, if not all of them on the whole image.
    pub arrangement: Option<Arrangement>,
}

/// The thesis's five algorithms, CTCSBP also with other digits, which fit its times better; and four plans of ours.
/// Ours use the census transform as data cost on few grids, with few iterations, many half-steps or one sweep per grid, with
/// label sets and without.
pub fn all() -> Vec<Planned> {
    let thesis = |name, algorithm: Algorithm, z: u32| Planned {
        name,
        algorithm,
        profile: Profile::Thesis,
        z: algorithm.divides_loops().then_some(z),
        schedule: Schedule::Sync,
        fixed: None,
        label_sets: false,
        arrangement: None,
    };
    let mut plans: Vec<_> = Algorithm::THESIS.map(|algorithm| thesis(algorithm.name(), algorithm, Z)).into();
    plans.push(thesis("ctcsbp-z3", Algorithm::Ctcsbp, 3));
    plans.push(thesis("ctcsbp-z4", Algorithm::Ctcsbp, 4));
    let census = |name, algorithm| Planned { profile: Profile::Census, ..thesis(name, algorithm, Z) };
    plans.push(Planned { fixed: Some((5, 2)), ..census(CENSUS, Algorithm::Cfbp) });
    let half_steps = Planned { schedule: Schedule::Checkerboard, ..census("hierarchy", Algorithm::Cfbp) };
    plans.push(Planned { fixed: Some((5, 10)), ..half_steps });
    let sweep = |name| Planned {
        profile: Profile::Census16,
        schedule: Schedule::Sweep,
        fixed: Some((5, 1)),
        ..thesis(name, Algorithm::Sweep, Z)
    };
    plans.push(Planned { label_sets: true, ..sweep("sweep") });
    plans.push(sweep("sweep-all-labels"));
    plans
}

/// Those that arrange the workers otherwise: plain BP on one worker, and the parts of CTBP and CTCSBP side by side or in turn.
pub fn arranged() -> Vec<Planned> {
    let workers = rayon::current_num_threads().min(4);
    let (side_by_side, in_turn) = (Arrangement::SideBySide { workers }, Arrangement::InTurn);
    let arranged = [
        ("bp-one-worker", "bp", Arrangement::OneWorker),
        ("ctbp-side-by-side", "ctbp", side_by_side),
        ("ctbp-in-turn", "ctbp", in_turn),
        ("ctcsbp-side-by-side", "ctcsbp", side_by_side),
        ("ctcsbp-in-turn", "ctcsbp", in_turn),
    ];
    let all = all();
    let arranged = arranged.into_iter().filter_map(|(name, whole, arrangement)| {
        let whole = *all.iter().find(|planned| planned.name == whole)?;
        Some(Planned { name, arrangement: Some(arrangement), ..whole })
    });
    arranged.collect()
}

/// Name of our plan with census costs and few iterations.
pub const CENSUS: &str = "census";

impl Planned {
    /// The plan for images of `size`. Its number of iterations is derived from `k`, unless it is fixed.
    pub fn plan(&self, size: Size, labels: usize, k: u32) -> Result<Plan, Error> {
        let model = Model::new(self.profile, labels)?;
        let settings = self.algorithm.settings(size, k, self.z.unwrap_or(1), self.schedule);
        let settings = match self.fixed {
            Some((grids, steps)) => Settings { grids, steps, ..settings },
            None => settings,
        };
        let settings = Settings { label_sets: self.label_sets && labels >= LabelSet::WORTHWHILE, ..settings };
        Plan::new(size, model, settings)
    }

    /// Whether it differs on this device from the plan of the whole image with all workers.
    pub fn suits(&self, info: &DeviceInfo) -> bool {
        self.arrangement != Some(Arrangement::OneWorker) || info.kind == DeviceKind::Processor && info.workers > 1
    }

    /// How its parts share the machine, if they have plans of their own.
    pub fn parting(&self) -> Option<Parting> {
        match self.arrangement? {
            Arrangement::OneWorker => None,
            Arrangement::SideBySide { workers } => Some(Parting::SideBySide { workers }),
            Arrangement::InTurn => Some(Parting::InTurn),
        }
    }

    /// The iterations that its own are derived from; `None` if those are fixed.
    pub fn k(&self, k: u32) -> Option<u32> {
        self.fixed.is_none().then_some(k)
    }
}
