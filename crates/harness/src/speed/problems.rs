//! What is solved: problems that need no file and never change, so that numbers of one machine can stand beside
//! another's.

use bp_core::{Algorithm, Error, Image, Model, Plan, Profile, Schedule, Settings, Size, StereoPair};

/// A problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Problem {
    name: &'static str,
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
    HalfSteps(usize, u32),
    /// As [`Algorithm::Sweep`] says.
    Sweep,
}

impl Problem {
    /// All of them: the update alone, our two plans, the thesis's BP, and the size at which others publish times.
    pub(crate) const ALL: [Self; 5] = [
        Self::new("update", [620, 555], 64, Profile::Thesis, Passing::Loops(10)),
        Self::new("hierarchy", [620, 555], 128, Profile::Census, Passing::HalfSteps(5, 10)),
        Self::new("sweep", [620, 555], 128, Profile::Census, Passing::Sweep),
        Self::new("thesis", [620, 555], 112, Profile::Thesis, Passing::Loops(112)),
        Self::new("published", [900, 750], 128, Profile::Census, Passing::HalfSteps(5, 7)),
    ];

    const fn new(name: &'static str, size: [usize; 2], labels: usize, profile: Profile, passing: Passing) -> Self {
        Self { name, size, labels, profile, passing }
    }

    /// Its name in options and records.
    pub(crate) fn name(self) -> &'static str {
        self.name
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
