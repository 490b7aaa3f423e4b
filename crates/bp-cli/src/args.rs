//! The command line.

mod examples;
mod finishing;
mod many;
mod matching;
mod meaning;
mod measuring;
mod outputs;
mod records;
mod rectifying;
mod streaming;
mod values;

use std::path::PathBuf;

use clap::{
    Args, Parser, Subcommand,
    builder::{OsStringValueParser, PossibleValuesParser, TypedValueParser},
};

pub(crate) use finishing::{Check, FinishArgs};
pub(crate) use many::ManyArgs;
pub(crate) use matching::{EvaluateArgs, MatchArgs, PlanArgs, TruthArgs};
pub(crate) use measuring::{ConformArgs, GateArgs, ReproduceArgs, SpeedArgs};
pub(crate) use outputs::{ConvertArgs, OutputArgs};
pub(crate) use records::{CompareArgs, ExportArgs, ReportArgs};
pub(crate) use rectifying::RectifyArgs;

use crate::failure::Failure;

/// Stereo matching by belief propagation: match pairs, evaluate maps, reproduce the thesis's tables.
#[derive(Debug, Parser)]
#[command(name = "bp", version, max_term_width = 110, after_help = examples::program())]
pub(crate) struct Cli {
    /// Print only errors: no progress, notes or warnings.
    #[arg(long, short, global = true)]
    pub(crate) quiet: bool,
    /// The command.
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Compute the disparity map of a rectified pair.
    #[command(after_help = examples::MATCH)]
    Match(Box<MatchArgs>),
    /// Turn a pair of raw images into a rectified pair, with a calibration of the cameras.
    #[command(after_help = examples::RECTIFY)]
    Rectify(RectifyArgs),
    /// Convert a disparity map to depth, points, a picture or another format.
    #[command(after_help = examples::CONVERT)]
    Convert(Box<ConvertArgs>),
    /// Measure the errors of a disparity map against ground truth.
    #[command(after_help = examples::EVALUATE)]
    Evaluate(EvaluateArgs),
    /// Repeat the thesis's experiments on six scenes: every table, chart and figure, with its numbers beside ours.
    #[command(after_help = examples::REPRODUCE)]
    Reproduce(ReproduceArgs),
    /// Rewrite the report of a recorded run, or the part of a page that is generated from it.
    #[command(after_help = examples::REPORT)]
    Report(ReportArgs),
    /// List the scenes and check the files of a data folder.
    #[command(after_help = examples::SCENES)]
    Scenes(ScenesArgs),
    /// List the devices of all backends, by the names that --backend accepts.
    #[command(after_help = examples::DEVICES)]
    Devices(DevicesArgs),
    /// Check this machine, and report what is missing and which package provides it.
    #[command(after_help = examples::DOCTOR)]
    Doctor(DoctorArgs),
    /// Check that backends give the same labels and messages as the reference, to the bit.
    #[command(after_help = examples::CONFORM)]
    Conform(ConformArgs),
    /// Compare the speed of devices on fixed problems, in turns and in one process.
    #[command(after_help = examples::SPEED)]
    Speed(SpeedArgs),
    /// Check speed-ups, accuracy, energy and memory against committed baselines; exit code 4 if the check fails.
    #[command(after_help = examples::GATE)]
    Gate(GateArgs),
    /// Compare recorded runs of several machines, commits or backends.
    #[command(after_help = examples::COMPARE)]
    Compare(CompareArgs),
    /// Write a recorded run in the format of another program.
    #[command(after_help = examples::EXPORT)]
    Export(ExportArgs),
    /// Print a shell's completion script for commands and options.
    #[command(after_help = examples::COMPLETIONS)]
    Completions(CompletionsArgs),
    /// Write man pages.
    #[command(after_help = examples::MAN)]
    Man(ManArgs),
}

/// The scenes.
#[derive(Debug, Args)]
pub(crate) struct DataArgs {
    /// Folder of the public data sets (see scripts/fetch-middlebury). Without it, the synthetic scenes are used.
    // An empty variable means no folder. Clap's own parser of paths would refuse it.
    #[arg(long, env = "BP_DATA", value_name = "DIR", value_parser = OsStringValueParser::new().map(PathBuf::from))]
    pub(crate) data: Option<PathBuf>,
    /// Use the synthetic scenes even if a data folder is given.
    #[arg(long)]
    pub(crate) synthetic: bool,
}

impl DataArgs {
    /// The data folder, if the data comes from one.
    pub(crate) fn folder(&self) -> Option<PathBuf> {
        self.data.clone().filter(|folder| !folder.as_os_str().is_empty() && !self.synthetic)
    }
}

/// `bp scenes`.
#[derive(Debug, Args)]
pub(crate) struct ScenesArgs {
    /// The scenes.
    #[command(flatten)]
    pub(crate) data: DataArgs,
}

/// `bp completions`.
#[derive(Debug, Args)]
pub(crate) struct CompletionsArgs {
    /// The shell.
    pub(crate) shell: clap_complete::Shell,
}

/// `bp man`.
#[derive(Debug, Args)]
pub(crate) struct ManArgs {
    /// The folder to write bp.1, bp-match.1 and so on into.
    pub(crate) folder: PathBuf,
}

/// `bp devices`.
#[derive(Debug, Args)]
pub(crate) struct DevicesArgs {
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// `bp doctor`.
#[derive(Debug, Args)]
pub(crate) struct DoctorArgs {
    /// Folder of the public data sets.
    #[arg(long, env = "BP_DATA", value_name = "DIR", value_parser = OsStringValueParser::new().map(PathBuf::from))]
    pub(crate) data: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// The most threads that may be asked for.
const MOST_THREADS: u16 = 1024;

fn threads() -> impl TypedValueParser<Value = u16> {
    clap::value_parser!(u16).range(1..=i64::from(MOST_THREADS))
}

/// Fails if the environment asks for more threads than `--threads` may: by the variable that Rayon reads, or its older name.
pub(crate) fn check_environment() -> Result<(), Failure> {
    for name in ["RAYON_NUM_THREADS", "RAYON_RS_NUM_CPUS"] {
        let asked = std::env::var(name).ok().and_then(|text| text.parse::<u64>().ok());
        if let Some(threads) = asked.filter(|&threads| threads > u64::from(MOST_THREADS)) {
            return Err(Failure::usage(format!("{name}={threads}: at most {MOST_THREADS} threads")));
        }
    }
    Ok(())
}

fn positive(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("must be a number above 0".to_owned()),
    }
}

/// A parser that accepts the names of `all`.
fn named<T: Copy + Send + Sync>(all: &'static [T], name: fn(T) -> &'static str) -> impl TypedValueParser<Value = T> {
    let names = PossibleValuesParser::new(all.iter().map(|&value| name(value)));
    names.try_map(move |text| all.iter().copied().find(|&value| name(value) == text).ok_or("not one of the names"))
}

fn switch(on: bool) -> &'static str {
    if on { "on" } else { "off" }
}
