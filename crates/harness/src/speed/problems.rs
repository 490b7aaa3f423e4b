//! What is solved: problems that need no file and never change, so that numbers of one machine can stand beside
//! another's.

use bp_core::{Algorithm, Error, Image, Model, Plan, Profile, Schedule, Settings, Size, StereoPair};

use super::record::Family;

/// A problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Problem {
    name: &'static str,
    family: Option<Family>,
    /// Width and height in pixels.
    size: [usize; 2],
    labels: usize,
    profile: Profile,
    passing: Passing,
}

/// How messages are passed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Passing {
    /// So many synchronous loops on one grid.
    Loops(u32),
    /// On each of so many grids so many half-steps in checkerboard order.
    HalfSteps(u32, u32),
    /// As [`Algorithm::Sweep`] says.
    Sweep,
}

impl Problem {
    const UPDATE: Self = Self::new("update", [620, 555], 64, Profile::Thesis, Passing::Loops(10));
    const HIERARCHY: Self = Self::new("hierarchy", [620, 555], 128, Profile::Census, Passing::HalfSteps(5, 10));
    const SWEEP: Self = Self::new("sweep", [620, 555], 128, Profile::Census, Passing::Sweep);

    /// Those by which kernels are compared.
    pub(crate) const KERNELS: [Self; 3] = [Self::UPDATE, Self::HIERARCHY, Self::SWEEP];

    /// All of them: the update alone, our two plans, the thesis's BP, the size at which others publish times, and the
    /// families, small enough that a slow device is soon done with them.
    pub(crate) const ALL: [Self; 23] = [
        Self::UPDATE,
        Self::HIERARCHY,
        Self::SWEEP,
        Self::new("thesis", [620, 555], 112, Profile::Thesis, Passing::Loops(112)),
        Self::new("published", [900, 750], 128, Profile::Census, Passing::HalfSteps(5, 7)),
        Self::one_of(Family::Pixels, "pixels-x1", [80, 60], 16, 5),
        Self::one_of(Family::Pixels, "pixels-x4", [160, 120], 16, 5),
        Self::one_of(Family::Pixels, "pixels-x16", [320, 240], 16, 5),
        Self::one_of(Family::Pixels, "pixels-x64", [640, 480], 16, 5),
        Self::one_of(Family::Pixels, "pixels-x256", [1280, 960], 16, 5),
        Self::one_of(Family::Labels, "labels-8", [240, 180], 8, 5),
        Self::one_of(Family::Labels, "labels-16", [240, 180], 16, 5),
        Self::one_of(Family::Labels, "labels-32", [240, 180], 32, 5),
        Self::one_of(Family::Labels, "labels-64", [240, 180], 64, 5),
        Self::one_of(Family::Labels, "labels-128", [240, 180], 128, 5),
        Self::one_of(Family::Labels, "labels-256", [240, 180], 256, 5),
        Self::one_of(Family::Loops, "loops-1", [320, 240], 16, 1),
        Self::one_of(Family::Loops, "loops-2", [320, 240], 16, 2),
        Self::one_of(Family::Loops, "loops-4", [320, 240], 16, 4),
        Self::one_of(Family::Loops, "loops-8", [320, 240], 16, 8),
        Self::one_of(Family::Loops, "loops-16", [320, 240], 16, 16),
        Self::one_of(Family::Loops, "loops-32", [320, 240], 16, 32),
        Self::one_of(Family::Loops, "loops-64", [320, 240], 16, 64),
    ];

    /// By what they can be asked for: the name of a problem, or that of a family for all of it.
    pub(crate) const ASKED: [&str; 8] =
        ["update", "hierarchy", "sweep", "thesis", "published", "pixels", "labels", "loops"];

    const fn new(name: &'static str, size: [usize; 2], labels: usize, profile: Profile, passing: Passing) -> Self {
        Self { name, family: None, size, labels, profile, passing }
    }

    const fn one_of(family: Family, name: &'static str, size: [usize; 2], labels: usize, loops: u32) -> Self {
        Self { family: Some(family), ..Self::new(name, size, labels, Profile::Thesis, Passing::Loops(loops)) }
    }

    /// Its name in records.
    pub(crate) const fn name(self) -> &'static str {
        self.name
    }

    /// The problems beside it that are alike but for one number.
    pub(super) fn family(self) -> Option<Family> {
        self.family
    }

    /// Whether one of these names asks for it.
    pub(super) fn is_asked(self, names: &[String]) -> bool {
        names.iter().any(|name| *name == self.family.map_or(self.name, Family::name))
    }

    /// The algorithm that its settings come from.
    pub(super) fn algorithm(self) -> Algorithm {
        match self.passing {
            Passing::Loops(_) => Algorithm::Bp,
            Passing::HalfSteps(..) => Algorithm::Cfbp,
            Passing::Sweep => Algorithm::Sweep,
        }
    }

    /// Its plan for images whose sides are divided by `divisor`, rounded up.
    pub(crate) fn plan(self, divisor: usize) -> Result<Plan, Error> {
        let [width, height] = self.size.map(|side| side.div_ceil(divisor));
        let size = Size { width, height };
        let settings = |loops, schedule| self.algorithm().settings(size, loops, 1, schedule);
        let settings = match self.passing {
            Passing::Loops(loops) => settings(loops, Schedule::Sync),
            Passing::HalfSteps(grids, steps) => Settings { grids, steps, ..settings(1, Schedule::Checkerboard) },
            Passing::Sweep => settings(1, Schedule::Sweep),
        };
        Plan::new(size, Model::new(self.profile, self.labels)?, settings)
    }
}

/// A pair of this size: the scene, repeated to the right and below where that is larger. Times hardly depend on what
/// images show.
pub(super) fn pair(scene: &StereoPair, Size { width, height }: Size) -> Result<StereoPair, Error> {
    let repeated = |image: &Image| {
        let from = image.size();
        let pixel = |i: usize| image.rgb(i % width % from.width, i / width % from.height);
        Image::from_rgb(width, height, (0..width * height).map(pixel).collect())
    };
    StereoPair::new(repeated(scene.left())?, repeated(scene.right())?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_problem_has_a_name_of_its_own_and_can_be_asked_for() {
        let asked = Problem::ASKED.map(str::to_owned);
        for (i, problem) in Problem::ALL.into_iter().enumerate() {
            assert!(problem.is_asked(&asked) && problem.plan(3).is_ok(), "{}", problem.name);
            assert!(Problem::ALL[..i].iter().all(|other| other.name != problem.name), "{}", problem.name);
        }
        for name in asked {
            assert!(Problem::ALL.into_iter().any(|problem| problem.is_asked(std::slice::from_ref(&name))), "{name}");
        }
    }

    /// Times of a slow device: 2.5 ns a message entry.
    #[test]
    fn a_slow_device_solves_a_family_in_seconds() {
        for family in Family::ALL {
            let own = Problem::ALL.into_iter().filter(|problem| problem.family == Some(family));
            let entries: u64 = own.map(|problem| problem.plan(1).unwrap().message_updates()).sum();
            assert!((1e8..1.5e9).contains(&(entries as f64)), "{}: {entries}", family.name());
        }
    }
}
