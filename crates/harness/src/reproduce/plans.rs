//! What is run on every scene.

use bp_core::{Algorithm, Error, Model, Plan, Profile, Schedule, Settings, Size};

/// Z'' and Z'''' where nothing else is said: the digit that the thesis lost is most likely this one.
const Z: u32 = 2;

/// A plan of the tables.
#[derive(Clone, Copy, Debug)]
pub struct Planned {
    /// Its name in records.
    pub name: &'static str,
    /// Its algorithm.
    pub algorithm: Algorithm,
    profile: Profile,
    /// What loops are divided by.
    pub z: Option<u32>,
    schedule: Schedule,
    /// Grids and steps on each, in place of the algorithm's own.
    fixed: Option<(u32, u32)>,
}

/// The thesis's five algorithms; CTCSBP with other digits too, since its times fit those better; and three of
/// ours, with the census transform as data cost on few grids: few loops, many half-steps, and one sweep a grid.
pub fn all() -> Vec<Planned> {
    let thesis = |name, algorithm: Algorithm, z: u32| Planned {
        name,
        algorithm,
        profile: Profile::Thesis,
        z: algorithm.divides_loops().then_some(z),
        schedule: Schedule::Sync,
        fixed: None,
    };
    let mut plans: Vec<_> = Algorithm::THESIS.map(|algorithm| thesis(algorithm.name(), algorithm, Z)).into();
    plans.push(thesis("ctcsbp-z3", Algorithm::Ctcsbp, 3));
    plans.push(thesis("ctcsbp-z4", Algorithm::Ctcsbp, 4));
    let census = |name, algorithm| Planned { profile: Profile::Census, ..thesis(name, algorithm, Z) };
    plans.push(Planned { fixed: Some((5, 2)), ..census(CENSUS, Algorithm::Cfbp) });
    let half_steps = Planned { schedule: Schedule::Checkerboard, ..census("hierarchy", Algorithm::Cfbp) };
    plans.push(Planned { fixed: Some((5, 10)), ..half_steps });
    plans.push(Planned { schedule: Schedule::Sweep, fixed: Some((5, 1)), ..census("sweep", Algorithm::Sweep) });
    plans
}

/// Name of our plan with census costs and few loops.
pub const CENSUS: &str = "census";

impl Planned {
    /// The plan for images of `size`, with so many labels; `k` loops are what its own are derived from, unless those are
    /// fixed.
    pub fn plan(&self, size: Size, labels: usize, k: u32) -> Result<Plan, Error> {
        let model = Model::new(self.profile, labels)?;
        let settings = self.algorithm.settings(size, k, self.z.unwrap_or(1), self.schedule);
        let settings = match self.fixed {
            Some((grids, steps)) => Settings { grids, steps, ..settings },
            None => settings,
        };
        Plan::new(size, model, settings)
    }

    /// The loops that its own are derived from.
    pub fn k(&self, k: u32) -> Option<u32> {
        self.fixed.is_none().then_some(k)
    }
}
