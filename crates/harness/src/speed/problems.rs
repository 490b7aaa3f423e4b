//! The problems to solve. They need no files and never change, so results of different machines can be compared.

use bp_core::{Algorithm, Error, Image, LabelSet, Model, Plan, Profile, Schedule, Settings, Size, StereoPair};

use crate::record::speed::Family;

/// Baby1's size in the thesis.
const BABY1: [usize; 2] = [620, 555];

/// A problem.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Its name in records.
    pub name: String,
    /// The name that selects it with `--problem`: its own, or that of several similar problems.
    group: &'static str,
    /// Its family, if any: problems that differ in one number only.
    pub(super) family: Option<Family>,
    /// Width and height in pixels.
    size: [usize; 2],
    labels: usize,
    profile: Profile,
    passing: Passing,
}

/// How messages are passed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Passing {
    /// This many synchronous loops on one grid.
    Loops(u32),
    /// The thesis's CFCSBP for this many requested loops, with Z'' = 2.
    Cfcsbp(u32),
    /// This many half-steps in checkerboard order on each grid.
    HalfSteps { grids: u32, steps: u32 },
    /// As defined by [`Algorithm::Sweep`].
    Sweep,
}

impl Passing {
    /// The data cost of problems with census costs: that of the default matcher, or the one without edge levels.
    fn profile(self) -> Profile {
        if self == Self::Sweep { Profile::Census16 } else { Profile::Census }
    }
}

impl Problem {
    /// The groups that `--problem` accepts. Those after the first `BY_DEFAULT` take long, or are informative on fast
    /// devices only. They run only if named.
    pub const ASKED: [&str; 14] = [
        "update",
        "hierarchy",
        "sweep",
        "thesis",
        "published",
        "pixels",
        "labels",
        "loops",
        "half-steps",
        "cfcsbp",
        "peers",
        "sweep-pixels",
        "half-step-pixels",
        "half-step-labels",
    ];

    /// How many groups run by default.
    const BY_DEFAULT: usize = 8;

    /// The groups that compare kernels. Each has one problem.
    pub const KERNELS: [&str; 3] = ["update", "hierarchy", "sweep"];

    /// The problems of the named groups, or those that run by default if `names` is empty.
    pub fn asked(names: &[String]) -> Vec<Self> {
        let by_default = Self::ASKED[..Self::BY_DEFAULT].iter().map(|&name| name.to_owned()).collect();
        let names = if names.is_empty() { by_default } else { names.to_vec() };
        Self::ASKED.into_iter().filter(|&group| names.iter().any(|name| name == group)).flat_map(Self::group).collect()
    }

    /// The problems of a group.
    fn group(group: &'static str) -> Vec<Self> {
        let half_steps = |grids, steps| Passing::HalfSteps { grids, steps };
        let census = |size, labels, passing: Passing| vec![Self::new(group, size, labels, passing.profile(), passing)];
        let thesis = |labels, passing| vec![Self::new(group, BABY1, labels, Profile::Thesis, passing)];
        match group {
            "update" => thesis(64, Passing::Loops(10)),
            "hierarchy" => census(BABY1, 128, half_steps(5, 10)),
            "sweep" => census(BABY1, 128, Passing::Sweep),
            "thesis" => thesis(112, Passing::Loops(112)),
            // The size and the number of labels for which others publish times.
            "published" => census([900, 750], 128, half_steps(5, 7)),
            "half-steps" => census(BABY1, 128, half_steps(1, 10)),
            "cfcsbp" => thesis(112, Passing::Cfcsbp(112)),
            "peers" => [("tsukuba", [384, 288], 16), ("cones", [450, 375], 64), ("aloe", [641, 555], 112)]
                .into_iter()
                .flat_map(|(pair, size, labels)| {
                    census(size, labels, Passing::Sweep).into_iter().map(move |problem| problem.named(pair))
                })
                .collect(),
            _ => Family::ALL.into_iter().filter(|family| family.name() == group).flat_map(Self::family).collect(),
        }
    }

    /// The problems of a family. Even a slow device solves each of the first three families in seconds.
    fn family(family: Family) -> Vec<Self> {
        let of = |name: String, size, labels, passing| Self {
            family: Some(family),
            ..Self::new(family.name(), size, labels, Profile::Thesis, passing).named(&name)
        };
        let census = |problem: Self| Self { profile: problem.passing.profile(), ..problem };
        let large = |passing| {
            let problem = |megapixels: f64| {
                let width = (megapixels * 1e6 * 4.0 / 3.0).sqrt().round();
                let size = [width as usize, (0.75 * width).round() as usize];
                census(of(format!("{megapixels}mp"), size, 64, passing))
            };
            [0.1, 0.3, 1.0, 3.0, 10.0, 30.0].map(problem).into()
        };
        let half_steps = Passing::HalfSteps { grids: 1, steps: 10 };
        match family {
            Family::Pixels => [1, 2, 4, 8, 16]
                .map(|times| of(format!("x{}", times * times), [80 * times, 60 * times], 16, Passing::Loops(5)))
                .into(),
            Family::Labels => [8, 16, 32, 64, 128, 256]
                .map(|labels| of(labels.to_string(), [240, 180], labels, Passing::Loops(5)))
                .into(),
            Family::Loops => [1, 2, 4, 8, 16, 32, 64]
                .map(|loops| of(loops.to_string(), [320, 240], 16, Passing::Loops(loops)))
                .into(),
            Family::SweepPixels => large(Passing::Sweep),
            Family::HalfStepPixels => large(half_steps),
            Family::HalfStepLabels => [2, 16, 64, 128, 300, 512]
                .map(|labels| census(of(labels.to_string(), BABY1, labels, half_steps)))
                .into(),
        }
    }

    fn new(group: &'static str, size: [usize; 2], labels: usize, profile: Profile, passing: Passing) -> Self {
        Self { name: group.to_owned(), group, family: None, size, labels, profile, passing }
    }

    /// The problem under a name that tells it from the others of its group.
    fn named(self, name: &str) -> Self {
        Self { name: format!("{}-{name}", self.group), ..self }
    }

    /// The algorithm that its settings come from.
    pub(super) fn algorithm(&self) -> Algorithm {
        match self.passing {
            Passing::Loops(_) => Algorithm::Bp,
            Passing::Cfcsbp(_) => Algorithm::Cfcsbp,
            Passing::HalfSteps { .. } => Algorithm::Cfbp,
            Passing::Sweep => Algorithm::Sweep,
        }
    }

    /// Its plan for images whose sides are divided by `divisor`, rounded up.
    pub fn plan(&self, divisor: usize) -> Result<Plan, Error> {
        let [width, height] = self.size.map(|side| side.div_ceil(divisor));
        let size = Size { width, height };
        let settings = |loops, z, schedule| self.algorithm().settings(size, loops, z, schedule);
        let settings = match self.passing {
            Passing::Loops(loops) => settings(loops, 1, Schedule::Sync),
            Passing::Cfcsbp(loops) => settings(loops, 2, Schedule::Sync),
            Passing::HalfSteps { grids, steps } => Settings { grids, steps, ..settings(1, 1, Schedule::Checkerboard) },
            Passing::Sweep => {
                Settings { label_sets: self.labels >= LabelSet::WORTHWHILE, ..settings(1, 1, Schedule::Sweep) }
            }
        };
        Plan::new(size, Model::new(self.profile, self.labels)?, settings)
    }
}

/// A pair of this size. Where it is larger than the scene, the scene repeats to the right and below. Times hardly
/// depend on the content of images.
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
    fn every_group_has_problems_and_every_problem_a_name_of_its_own() {
        let mut names = Vec::new();
        for group in Problem::ASKED {
            let problems = Problem::asked(&[group.to_owned()]);
            assert!(!problems.is_empty() && problems.iter().all(|problem| problem.plan(3).is_ok()), "{group}");
            names.extend(problems.into_iter().map(|problem| problem.name));
        }
        for name in ["pixels-x256", "labels-8", "loops-64", "peers-cones", "sweep-pixels-0.1mp"] {
            assert!(names.iter().any(|known| known == name), "{name} is not in {names:?}");
        }
        let count = names.len();
        names.sort();
        names.dedup();
        assert_eq!((names.len(), Problem::asked(&[]).len()), (count, 23));
    }

    /// A slow device takes 2.5 ns per message entry.
    #[test]
    fn a_slow_device_solves_a_family_that_runs_by_default_in_seconds() {
        for family in [Family::Pixels, Family::Labels, Family::Loops] {
            let own = Problem::family(family);
            let entries: u64 = own.iter().map(|problem| problem.plan(1).unwrap().message_updates()).sum();
            assert!((1e8..1.5e9).contains(&(entries as f64)), "{}: {entries}", family.name());
        }
    }
}
