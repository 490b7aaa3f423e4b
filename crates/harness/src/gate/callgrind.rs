//! Counts the instructions of kernels with valgrind's callgrind. Times vary by several percent. Counts are the same in
//! every run, however busy the machine is. Only the placement of buffers in memory, which the C library decides,
//! changes them, by fractions of a percent.
//!
//! Counts are not times: they reveal extra work in one kernel, independent of the others. A kernel that waits for
//! memory, say because its working set left the cache, takes no more instructions.
//!
//! Every solve runs in a process of its own, on a CPU that valgrind simulates. That CPU lacks AVX-512, so the counts
//! may belong to another device than the times. The result names the device.

use std::{
    collections::BTreeMap,
    fs,
    path::Path,
    process::{Command, Stdio},
    time::Duration,
};

use bp_core::{Error, Image, Plan, Size, Stage, StereoPair};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use bp_stereo::Watch;

use crate::{
    failure::Failure,
    machine,
    measure::{Asked, Meter, Solve},
    speed::Problem,
};

/// Divisor of the width and height of the problems' images: under valgrind, a solve takes about fifty times as long.
const DIVISOR: usize = 6;

/// Disparity of all pixels.
const SHIFT: usize = 20;

/// Stages below this fraction of their solve's instructions are not reported, because they hardly do anything.
const TOLD_FROM: f64 = 0.001;

/// Counts, and the tools behind them. Counts of other compilers, flags, valgrinds or instruction sets are not comparable.
/// The CPU under valgrind hardly matters: kernels differed by at most 0.2 % between two generations.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Counts {
    /// Commit of the program.
    pub(super) commit: String,
    /// The CPU.
    pub(super) processor: String,
    /// The compiler.
    pub(super) rustc: String,
    /// Its flags.
    pub(super) flags: String,
    /// Name and version of valgrind.
    pub(super) valgrind: String,
    /// The device of each backend on valgrind's simulated CPU.
    pub(super) devices: BTreeMap<String, String>,
    /// Instructions by problem, backend and stage, over all grids.
    pub(super) counts: BTreeMap<String, u64>,
}

impl Counts {
    /// Describes everything, besides the program, that counts depend on.
    pub(super) fn tools(&self) -> String {
        let devices: Vec<_> = self.devices.iter().map(|(backend, device)| format!("{backend} on {device}")).collect();
        format!("{}, {}, {}, {}", devices.join(", "), self.rustc, self.flags, self.valgrind)
    }
}

/// A smaller version of a problem of `bp speed`, solved on one thread of a CPU backend in a process of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Counted {
    backend: &'static str,
    problem: &'static str,
}

impl Counted {
    /// The CPU backends on the message update alone and on our two plans.
    fn all() -> impl Iterator<Item = Self> {
        Problem::KERNELS.into_iter().flat_map(|problem| ["scalar", "rayon"].map(|backend| Self { backend, problem }))
    }

    /// Its name in the hidden option.
    fn name(self) -> String {
        format!("{}:{}", self.problem, self.backend)
    }

    /// Parses the value of the hidden option.
    ///
    /// # Errors
    /// If no solve has this name.
    pub fn parse(name: &str) -> Result<Self, String> {
        Self::all().find(|solve| solve.name() == name).ok_or_else(|| "not counted".to_owned())
    }

    /// Solves it once, in the process that valgrind runs; returns the device's name.
    pub fn run(self) -> Result<String, Failure> {
        let problem = Problem::asked(&[self.problem.to_owned()]).into_iter().next();
        let problem = problem.ok_or_else(|| Failure::other("there is no such problem"))?;
        solve(self.backend, problem.plan(DIVISOR)?)
    }

    /// Counts its instructions; returns the device's name and the counts by name.
    fn count(self, program: &Path, watch: &Watch<'_>) -> Result<(String, Vec<(String, u64)>), Failure> {
        watch.check()?;
        let counted =
            callgrind(program, &["gate", "--counted", &self.name()], watch).map_err(|e| e.of(&self.name()))?;
        watch.check()?;
        let whole: u64 = counted.instructions.iter().sum();
        let is_told = |&(_, count): &(Stage, u64)| count as f64 >= TOLD_FROM * whole as f64;
        let name = |stage: Stage| format!("{}, {}, {}", self.problem, self.backend, stage.name());
        let told = Stage::ALL.into_iter().zip(counted.instructions).filter(is_told);
        let counts = told.map(|(stage, count)| (name(stage), count)).collect();
        Ok((counted.printed.trim_end().to_owned(), counts))
    }
}

/// Solves a plan once on one thread; returns the device's name.
fn solve(backend: &str, plan: Plan) -> Result<String, Failure> {
    let runner = Asked::open(&format!("{backend}@1"))?.runner.map_err(Failure::unavailable)?;
    let pair = pair(plan.image_size())?;
    Solve::prepare(&runner, plan, &pair)?.sample(0, &Meter::new(&Watch::default()))?;
    Ok(runner.info.name)
}

/// Two shifted views of noise: under valgrind, rendering a scene would take longer than all kernels.
fn pair(size: Size) -> Result<StereoPair, Error> {
    let mut random = fastrand::Rng::with_seed(1);
    let noise: Vec<u8> = std::iter::repeat_with(|| random.u8(..)).take(size.pixels() + SHIFT).collect();
    let view = |from: usize| Image::from_grey(size.width, size.height, &noise[from..][..size.pixels()]);
    StereoPair::new(view(0)?, view(SHIFT)?)
}

/// Name and version of valgrind; `None` if it cannot be run.
pub(super) fn valgrind() -> Option<String> {
    let output = Command::new("valgrind").arg("--version").stdin(Stdio::null()).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim_end().to_owned())
}

/// Counts all solves with this valgrind. Several run at once, since they do not affect one another's counts.
pub(super) fn count(valgrind: String, watch: &Watch<'_>) -> Result<Counts, Failure> {
    let failed = |error| Failure::other(format!("cannot find this program's own file: {error}"));
    let program = std::env::current_exe().map_err(failed)?;
    let solves: Vec<_> = Counted::all().collect();
    let counted = solves.par_iter().map(|solve| solve.count(&program, watch)).collect::<Result<Vec<_>, _>>()?;
    let device = |(solve, (device, _)): (&Counted, &(String, _))| (solve.backend.to_owned(), device.clone());
    Ok(Counts {
        commit: machine::commit(),
        processor: machine::processor(&machine::machine(None)),
        rustc: env!("BP_RUSTC").to_owned(),
        flags: env!("BP_FLAGS").to_owned(),
        valgrind,
        devices: solves.iter().zip(&counted).map(device).collect(),
        counts: counted.into_iter().flat_map(|(_, counts)| counts).collect(),
    })
}

/// The result of a program that ran under callgrind.
struct Profile {
    /// Its standard output.
    printed: String,
    /// Instructions of the solver's kernels and of everything they call, in the order of [`Stage::ALL`].
    instructions: [u64; Stage::ALL.len()],
}

/// Runs a program under callgrind and reads the kernels' instructions from the profile.
fn callgrind(program: &Path, arguments: &[&str], watch: &Watch<'_>) -> Result<Profile, Failure> {
    let failed = |what: &dyn std::fmt::Display| Failure::other(format!("valgrind: {what}"));
    let folder = tempfile::tempdir().map_err(|e| failed(&format!("no temporary folder: {e}")))?;
    // Ignores the user's valgrind settings, and writes profiles that are easy to parse.
    let options = "--command-line-only=yes --quiet --tool=callgrind --callgrind-out-file=profile --demangle=no \
        --compress-strings=no --compress-pos=no";
    let mut command = Command::new("valgrind");
    command.args(options.split_whitespace()).arg(program).args(arguments);
    let output = command.current_dir(&folder).stdin(Stdio::null()).output().map_err(|e| failed(&e))?;
    if !output.status.success() {
        // Ctrl-C may have ended valgrind before this program received it.
        std::thread::sleep(Duration::from_millis(50));
        watch.check()?;
        let said = String::from_utf8_lossy(&output.stderr);
        return Err(failed(&format!("{}: {}", output.status, said.trim_end())));
    }
    let profile = fs::read_to_string(folder.path().join("profile")).map_err(|e| failed(&format!("profile: {e}")))?;
    let instructions = of_stages(&profile);
    if instructions[Stage::UpdateMessages as usize] == 0 {
        return Err(failed(&"its profile does not name the kernels; a stripped program cannot be counted"));
    }
    Ok(Profile { printed: String::from_utf8_lossy(&output.stdout).into_owned(), instructions })
}

/// Instructions of the kernels in a profile. `cfn=` names a called function, and the line after `calls=` ends with the
/// inclusive cost of those calls.
fn of_stages(profile: &str) -> [u64; Stage::ALL.len()] {
    let mut sums = [0; Stage::ALL.len()];
    let (mut called, mut lines) = (None, profile.lines());
    while let Some(line) = lines.next() {
        if let Some(symbol) = line.strip_prefix("cfn=") {
            called = stage(symbol);
        } else if line.starts_with("calls=") {
            let cost = lines.next().and_then(|line| line.split_whitespace().last()?.parse::<u64>().ok());
            if let (Some(stage), Some(cost)) = (called, cost) {
                sums[stage as usize] += cost;
            }
        }
    }
    sums
}

/// The kernel that a symbol implements as a method of the trait `Solver`. Functions that a kernel calls do not match,
/// even with the same name. Both mangling schemes write a function's length and name; then only a hash may follow.
fn stage(symbol: &str) -> Option<Stage> {
    let (symbol, _) = symbol.split_once(".llvm.").unwrap_or((symbol, ""));
    let ends = |name: &str| match symbol.rsplit_once(name) {
        Some((path, hash)) => path.contains("Solver") && (hash.is_empty() || hash.starts_with("17h")),
        None => false,
    };
    let is_kernel = |name: &str| ends(&format!("{}{name}", name.len()));
    // A solver that works on several grids at the same time does this in place of that stage.
    let passed = is_kernel("pass_messages").then_some(Stage::UpdateMessages);
    passed.or_else(|| Stage::ALL.into_iter().find(|stage| is_kernel(stage.name())))
}

#[cfg(test)]
mod tests {
    use bp_core::{Algorithm, Model, Profile, Schedule, Settings};

    use super::*;

    #[test]
    fn symbols_of_both_manglings_are_understood() {
        let scalar = "_RNvXs_NtCsabc_13bp_cpu_scalar6solverNtB4_12ScalarSolverNtNtCs1_7bp_core7backend6Solver";
        let rayon = "_ZN87_$LT$bp_cpu_rayon..solver..RayonSolver$u20$as$u20$bp_core..backend..Solver$GT$";
        for (symbol, expected) in [
            (format!("{scalar}15update_messages"), Some(Stage::UpdateMessages)),
            (format!("{scalar}6refine.llvm.123"), Some(Stage::Refine)),
            (format!("{rayon}7coarsen17h0123456789abcdefE"), Some(Stage::Coarsen)),
            (format!("{rayon}13pass_messages17h0123456789abcdefE"), Some(Stage::UpdateMessages)),
            (format!("{rayon}10match_cost17h0123456789abcdefE"), Some(Stage::MatchCost)),
            (format!("{rayon}13read_messages17h0123456789abcdefE"), None),
            (format!("{rayon}15update_messages28_$u7b$$u7b$closure$u7d$$u7d$17h0123456789abcdefE"), None),
            ("_ZN13bp_cpu_scalar15update_messages15update_messages17h0123456789abcdefE".to_owned(), None),
        ] {
            assert_eq!(stage(&symbol), expected, "{symbol}");
        }
    }

    #[test]
    fn calls_are_added_up_with_all_that_they_include() {
        let kernel = |name: &str| format!("cfn=_RNvXs_6solverNtB4_12ScalarSolverNtNtCs1_7bp_core7backend6Solver{name}");
        let (update, refine) = (kernel("15update_messages"), kernel("6refine"));
        let profile = format!(
            "events: Ir\nfn=driver\n0 7\n{update}\ncalls=2 0 \n0 1000\n{refine}\ncalls=1 0 \n0 30\ncfn=other\n\
            calls=9 0\n0 5\n\nfn=closure\n0 1\n{update}\ncalls=1 0 \n0 500\n"
        );
        assert_eq!(of_stages(&profile), [0, 0, 30, 1500, 0]);
        assert_eq!(of_stages("calls=1 0"), [0; 5]);
    }

    #[test]
    fn names_lead_back_to_solves() {
        assert_eq!(Counted::all().count(), 6);
        assert!(Counted::all().all(|solve| Counted::parse(&solve.name()) == Ok(solve)));
        assert!(Counted::parse("sweep:vulkan").is_err());
    }

    fn solve_loops(loops: u32) {
        let size = Size { width: 60, height: 40 };
        let settings = Settings { steps: loops, ..Algorithm::Bp.settings(size, 1, 1, Schedule::Sync) };
        let plan = Plan::new(size, Model::new(Profile::Thesis, 16).unwrap(), settings).unwrap();
        solve("rayon", plan).unwrap();
    }

    /// Run under callgrind by the last test, as are `ten_loops` and `fifteen_loops`.
    #[test]
    fn five_loops() {
        solve_loops(5);
    }

    #[test]
    fn ten_loops() {
        solve_loops(10);
    }

    #[test]
    fn fifteen_loops() {
        solve_loops(15);
    }

    #[test]
    fn counts_do_not_vary_and_grow_with_the_work() {
        if valgrind().is_none() {
            return eprintln!("skipped: no valgrind");
        }
        let program = std::env::current_exe().unwrap();
        let count = |test: &str| {
            let test = format!("gate::callgrind::tests::{test}");
            callgrind(&program, &["--exact", &test], &Watch::default()).unwrap().instructions
        };
        let [five, again, ten, fifteen] = ["five_loops", "five_loops", "ten_loops", "fifteen_loops"].map(count);
        let alike = |(&a, b): (&u64, u64)| a.abs_diff(b) as f64 <= 0.002 * a as f64;
        assert!(five.iter().zip(again).all(alike), "{five:?} {again:?}");
        let update = Stage::UpdateMessages as usize;
        // The stage also decides the labels, once.
        let ratio = (fifteen[update] - ten[update]) as f64 / (ten[update] - five[update]) as f64;
        assert!((0.95..1.05).contains(&ratio), "{five:?} {ten:?} {fifteen:?}");
        let match_cost = Stage::MatchCost as usize;
        assert!(alike((&five[match_cost], ten[match_cost])), "{five:?} {ten:?}");
    }
}
