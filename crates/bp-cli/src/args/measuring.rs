//! Running experiments.

use std::path::PathBuf;

use clap::{Args, ValueEnum, builder::NonEmptyStringValueParser};

use super::{DataArgs, threads};
use bp_stereo::devices;
use harness::{
    gate::{Counted, GateOptions, Renewal},
    reproduce::ReproduceOptions,
    speed::{Problem, SpeedOptions},
};

/// `bp reproduce`.
#[derive(Debug, Args)]
#[command(args_override_self = true)]
pub(crate) struct ReproduceArgs {
    /// Which scenes.
    #[command(flatten)]
    pub(crate) data: DataArgs,
    /// Small images and few loops: within a minute on two cores. Says so in the output.
    #[arg(long)]
    pub(crate) quick: bool,
    /// Backends, separated by commas; NAME:DEVICE for another than a backend's first device, by its index, a part of
    /// its name or the beginning of its UUID.
    #[arg(long, value_delimiter = ',', default_value = devices::DEFAULT, value_name = "NAMES")]
    pub(crate) backend: Vec<String>,
    /// Threads of the backend rayon. [default: RAYON_NUM_THREADS, else one a processor]
    #[arg(long, value_name = "N", value_parser = threads())]
    pub(crate) threads: Option<u16>,
    /// Samples of every cell that takes less than 5 s; longer ones get one. [default: 5, with --quick 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) samples: Option<u32>,
    /// Folder for recorded runs; every run gets a new folder in it.
    #[arg(long, default_value = "results", value_name = "DIR")]
    pub(crate) results: PathBuf,
    /// Name of this machine in that folder. [default: from its processor]
    #[arg(long, value_name = "NAME", value_parser = NonEmptyStringValueParser::new())]
    pub(crate) machine: Option<String>,
}

/// `bp conform`.
#[derive(Debug, Args)]
pub(crate) struct ConformArgs {
    /// Backends, separated by commas; NAME:DEVICE for another than a backend's first device.
    #[arg(long, value_delimiter = ',', default_value = devices::DEFAULT, value_name = "NAMES")]
    pub(crate) backend: Vec<String>,
}

/// `bp speed`.
#[derive(Debug, Args)]
pub(crate) struct SpeedArgs {
    /// Backends, separated by commas. The others are compared with the first. NAME:DEVICE is another than a backend's
    /// first device, NAME@THREADS runs on that many threads: rayon@1,rayon@2.
    #[arg(long, value_delimiter = ',', default_value = devices::DEFAULT, value_name = "NAMES")]
    pub(crate) backend: Vec<String>,
    /// Problems, separated by commas. In pixels, labels and loops that number grows from problem to problem. [default:
    /// the first eight]
    #[arg(long, value_delimiter = ',', value_name = "NAMES", value_parser = Problem::ASKED)]
    pub(crate) problem: Vec<String>,
    /// Rounds, each of which runs every device once; a device that needs more than 5 s for a problem takes part in 3 of
    /// them. [default: 9, with --quick 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) rounds: Option<u32>,
    /// Images of a third of the width and height, and one round unless --rounds says otherwise. Says so in the output.
    #[arg(long)]
    pub(crate) quick: bool,
    /// Folder for speed.md, its charts and, with every sample, speed.json; none may be there yet.
    #[arg(long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    /// Threads of the backend rayon. [default: RAYON_NUM_THREADS, else one a processor]
    #[arg(long, value_name = "N", value_parser = threads())]
    pub(crate) threads: Option<u16>,
}

/// `bp gate`.
#[derive(Debug, Args)]
pub(crate) struct GateArgs {
    /// A smaller image and fewer loops: half a minute on two cores. Has baselines of its own.
    #[arg(long)]
    pub(crate) quick: bool,
    /// Rounds, each of which runs everything that is guarded once, in turns.
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(10..=1000))]
    pub(crate) rounds: u32,
    /// Folder of the baselines: one file for each kind of machine, and one for all.
    #[arg(long, value_name = "DIR", default_value = "bench-data/gate")]
    pub(crate) baselines: PathBuf,
    /// Count the instructions of the processor backends' kernels under valgrind, in place of taking times.
    #[arg(long, conflicts_with_all = ["quick", "rounds"])]
    pub(crate) instructions: bool,
    /// Write what is measured as the new baseline for this kind of machine, the median of three measurements; everywhere:
    /// for all machines too, after a change that is meant to change results.
    #[arg(long, value_name = "WHERE", num_args = 0..=1, require_equals = true, default_missing_value = "here")]
    pub(crate) update: Option<Where>,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
    /// What valgrind runs: solves this once on one thread.
    #[arg(long, hide = true, value_name = "SOLVE", value_parser = Counted::parse)]
    pub(crate) counted: Option<Counted>,
}

/// Which baselines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Where {
    /// The file for this kind of machine.
    Here,
    /// That and the file for all machines.
    Everywhere,
}

impl ReproduceArgs {
    /// What they ask for.
    pub(crate) fn options(&self) -> ReproduceOptions {
        ReproduceOptions {
            data: self.data.folder(),
            quick: self.quick,
            backends: self.backend.clone(),
            threads: self.threads,
            samples: self.samples,
            results: self.results.clone(),
            machine: self.machine.clone(),
        }
    }
}

impl SpeedArgs {
    /// What they ask for.
    pub(crate) fn options(&self) -> SpeedOptions {
        let (problems, output) = (self.problem.clone(), self.output.clone());
        SpeedOptions { problems, rounds: self.rounds, quick: self.quick, output }
    }
}

impl GateArgs {
    /// What they ask for.
    pub(crate) fn options(&self) -> GateOptions {
        let update = self.update.map(|update| match update {
            Where::Here => Renewal::Here,
            Where::Everywhere => Renewal::Everywhere,
        });
        GateOptions { quick: self.quick, rounds: self.rounds, baselines: self.baselines.clone(), update }
    }
}
