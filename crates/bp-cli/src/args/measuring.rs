//! Arguments for running experiments.

use std::{num::NonZeroUsize, path::PathBuf};

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
    /// The scenes.
    #[command(flatten)]
    pub(crate) data: DataArgs,
    /// Use small images and few loops: less than a minute on two cores. The output says so.
    #[arg(long)]
    pub(crate) quick: bool,
    /// Backends, separated by commas. NAME:DEVICE selects a device other than the first, by its index, a part of its
    /// name or the beginning of its UUID.
    #[arg(long, value_delimiter = ',', default_value = devices::DEFAULT, value_name = "NAMES")]
    pub(crate) backend: Vec<String>,
    /// Threads of the backend rayon. [default: RAYON_NUM_THREADS, else one per core]
    #[arg(long, value_name = "N", value_parser = threads())]
    pub(crate) threads: Option<u16>,
    /// Samples for each scene, plan and backend; at most 3 if it takes more than 5 s. [default: 5; 1 with --quick]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) samples: Option<u32>,
    /// Folder for recorded runs; every run gets a new folder in it.
    #[arg(long, default_value = "results", value_name = "DIR")]
    pub(crate) results: PathBuf,
    /// Name of this machine in the names of these folders. [default: from its processor]
    #[arg(long, value_name = "NAME", value_parser = NonEmptyStringValueParser::new())]
    pub(crate) machine: Option<String>,
}

/// `bp conform`.
#[derive(Debug, Args)]
pub(crate) struct ConformArgs {
    /// Backends, separated by commas. NAME:DEVICE selects a device other than the first.
    #[arg(long, value_delimiter = ',', default_value = devices::DEFAULT, value_name = "NAMES")]
    pub(crate) backend: Vec<String>,
    /// Check only every N-th case: drivers of GPUs take longer to prepare most cases than to solve them.
    #[arg(long, value_name = "N", default_value = "1")]
    pub(crate) every: NonZeroUsize,
}

/// `bp speed`.
#[derive(Debug, Args)]
pub(crate) struct SpeedArgs {
    /// Backends, separated by commas. The others are compared with the first. NAME:DEVICE selects a device other than
    /// the backend's first; NAME@THREADS runs on that many threads: rayon@1,rayon@2.
    #[arg(long, value_delimiter = ',', default_value = devices::DEFAULT, value_name = "NAMES")]
    pub(crate) backend: Vec<String>,
    /// Problems, separated by commas. pixels, labels and loops are families of problems in which that number grows.
    /// [default: the first eight]
    #[arg(long, value_delimiter = ',', value_name = "NAMES", value_parser = Problem::ASKED)]
    pub(crate) problem: Vec<String>,
    /// Rounds; each runs every device once. A device that needs more than 5 s for a problem runs in only 3 of them.
    /// [default: 9; 1 with --quick]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) rounds: Option<u32>,
    /// Use images with a third of the width and height, and one round unless --rounds is given. The output says so.
    #[arg(long)]
    pub(crate) quick: bool,
    /// Folder for speed.md, its charts, and speed.json with every sample. These files must not exist yet.
    #[arg(long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    /// Threads of the backend rayon. [default: RAYON_NUM_THREADS, else one per core]
    #[arg(long, value_name = "N", value_parser = threads())]
    pub(crate) threads: Option<u16>,
}

/// `bp gate`.
#[derive(Debug, Args)]
pub(crate) struct GateArgs {
    /// Use a smaller image and fewer loops: half a minute on two cores. Quick runs have their own baselines.
    #[arg(long)]
    pub(crate) quick: bool,
    /// Rounds; each runs every guarded measurement once, in turns.
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(10..=1000))]
    pub(crate) rounds: u32,
    /// Folder of the baselines: one file for each kind of machine, and one for all machines.
    #[arg(long, value_name = "DIR", default_value = "bench-data/gate")]
    pub(crate) baselines: PathBuf,
    /// Count the instructions of the CPU backends' kernels under valgrind, instead of measuring times.
    #[arg(long, conflicts_with_all = ["quick", "rounds"])]
    pub(crate) instructions: bool,
    /// Write a new baseline for this kind of machine: the median of three measurements. With everywhere, also write the
    /// baseline for all machines, after a change that is meant to change results.
    #[arg(long, value_name = "WHERE", num_args = 0..=1, require_equals = true, default_missing_value = "here")]
    pub(crate) update: Option<Where>,
    /// On a kind of machine without a baseline, write one of this measurement to a folder, if nothing fails.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["update", "instructions"])]
    pub(crate) propose: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
    /// Run by valgrind: solves this once on one thread.
    #[arg(long, hide = true, value_name = "SOLVE", value_parser = Counted::parse)]
    pub(crate) counted: Option<Counted>,
}

/// The baselines to write.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Where {
    /// The file for this kind of machine.
    Here,
    /// This file and the one for all machines.
    Everywhere,
}

impl ReproduceArgs {
    /// The options of the harness.
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
    /// The options of the harness.
    pub(crate) fn options(&self) -> SpeedOptions {
        let (problems, output) = (self.problem.clone(), self.output.clone());
        SpeedOptions { problems, rounds: self.rounds, quick: self.quick, output }
    }
}

impl GateArgs {
    /// The options of the harness.
    pub(crate) fn options(&self) -> GateOptions {
        let update = self.update.map(|update| match update {
            Where::Here => Renewal::Here,
            Where::Everywhere => Renewal::Everywhere,
        });
        let (baselines, proposal) = (self.baselines.clone(), self.propose.clone());
        GateOptions { quick: self.quick, rounds: self.rounds, baselines, update, proposal }
    }
}
