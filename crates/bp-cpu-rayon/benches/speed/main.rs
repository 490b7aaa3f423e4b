//! Measures how fast `bp-cpu-rayon` is on this machine: the claims made of it, in turns and in one process.
//!
//! `cargo bench -p bp-cpu-rayon --bench speed -- [GROUP ...] [--quick] [--output DIR] [--data DIR]`
//!
//! Without groups it measures all of them. The report goes to stdout; `--output` also writes it to DIR as `speed.md`,
//! with every sample in `speed.json` and charts as SVG and PNG. Real pairs come from `--data`, else the folder in the
//! environment variable `BP_DATA`; without either, made-up ones of the same sizes take their place. Folders are
//! relative to the workspace.
//!
//! The contestants of a group take turns: a round runs each of them once, so that whatever else the machine does
//! meanwhile meets them alike. What compares two of them is the median of the ratios within a round.

mod kernels;
mod machine;
mod matching;
mod pairs;
mod report;
mod roofline;
mod scaling;
mod solve;
mod statistics;
mod turns;

use std::{
    fs,
    path::{Path, PathBuf},
};

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::{
    machine::Machine,
    pairs::Data,
    report::{Group, Report},
};

/// Why nothing could be measured.
type Failure = Box<dyn std::error::Error>;

/// Measures a group.
type Measure = fn(&Bench) -> Result<Group, Failure>;

/// The groups by name, in the order of the report.
const GROUPS: [(&str, Measure); 7] = [
    ("update", matching::update),
    ("match", matching::whole_match),
    ("peers", matching::peers),
    ("thesis", matching::thesis),
    ("labels", scaling::labels),
    ("pixels", scaling::pixels),
    ("roofline", roofline::roofline),
];

/// What the options ask for.
#[derive(Default)]
struct Options {
    groups: Vec<String>,
    quick: bool,
    output: Option<PathBuf>,
    data: Option<PathBuf>,
    /// Given by `cargo bench`.
    bench: bool,
}

/// What groups share.
struct Bench {
    quick: bool,
    data: Data,
    /// Pools of 1 thread and of 2.
    pools: [ThreadPool; 2],
}

/// The numbers of threads of [`Bench::pools`].
const THREADS: [usize; 2] = [1, 2];

impl Bench {
    /// The pool of so many threads, 1 or 2.
    fn pool(&self, threads: usize) -> &ThreadPool {
        &self.pools[threads - 1]
    }

    /// `rounds`, or 3 for a quick look.
    fn rounds(&self, rounds: usize) -> usize {
        if self.quick { 3 } else { rounds }
    }
}

fn main() -> Result<(), Failure> {
    let options = options(std::env::args().skip(1))?;
    if !options.bench {
        eprintln!("nothing is measured: run it by cargo bench");
        return Ok(());
    }
    // Not to be told at the end only.
    if let Some(folder) = &options.output {
        fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    }
    let pool = |threads| ThreadPoolBuilder::new().num_threads(threads).build();
    let pools = [pool(THREADS[0])?, pool(THREADS[1])?];
    let bench = Bench { quick: options.quick, data: Data::new(options.data)?, pools };
    let machine = Machine::here();
    let mut report =
        Report { version: report::VERSION, quick: bench.quick, data: bench.data.described(), machine, groups: vec![] };
    report.machine.two_threads.push(two_threads(&bench));
    let asked = |name: &str| options.groups.is_empty() || options.groups.iter().any(|group| group == name);
    for (name, measure) in GROUPS.into_iter().filter(|(name, _)| asked(name)) {
        eprintln!("{name}");
        report.groups.push(measure(&bench).map_err(|error| format!("{name}: {error}"))?);
    }
    report.machine.two_threads.push(two_threads(&bench));
    print!("{}", report.markdown());
    options.output.map_or(Ok(()), |folder| report.write(&folder))
}

/// How many times as much arithmetic as one thread two threads do now; what else the machine does lowers it.
fn two_threads(bench: &Bench) -> f64 {
    let ratio = |_| {
        let [one, two] = THREADS.map(|count| kernels::arithmetic(bench.pool(count), 2_000_000));
        two / one
    };
    statistics::median(&(0..9).map(ratio).collect::<Vec<_>>())
}

fn options(mut arguments: impl Iterator<Item = String>) -> Result<Options, Failure> {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let data = std::env::var_os("BP_DATA").filter(|folder| !folder.is_empty());
    let mut options = Options { data: data.map(|folder| workspace.join(folder)), ..Options::default() };
    while let Some(argument) = arguments.next() {
        let mut folder = || arguments.next().map(|folder| Some(workspace.join(folder)));
        match argument.as_str() {
            "--bench" => options.bench = true,
            "--quick" => options.quick = true,
            "--output" => options.output = folder().ok_or("--output needs a folder")?,
            "--data" => options.data = folder().ok_or("--data needs a folder")?,
            name if GROUPS.iter().any(|(group, _)| *group == name) => options.groups.push(argument),
            other => {
                let groups = GROUPS.map(|(name, _)| name).join(", ");
                return Err(format!("{other}: neither an option nor a group; the groups are {groups}").into());
            }
        }
    }
    Ok(options)
}
