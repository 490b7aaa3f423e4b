//! The command line.

mod finishing;
mod matching;
mod measuring;
mod outputs;
mod records;

use std::path::PathBuf;

use clap::{
    Args, Parser, Subcommand,
    builder::{OsStringValueParser, PossibleValuesParser, TypedValueParser},
};

pub(crate) use finishing::FinishArgs;
pub(crate) use matching::{EvaluateArgs, Labels, MatchArgs, PlanArgs, TruthArgs};
pub(crate) use measuring::{ConformArgs, GateArgs, ReproduceArgs, SpeedArgs};
pub(crate) use outputs::{ConvertArgs, MakingArgs, OutputArgs};
pub(crate) use records::{CompareArgs, ExportArgs, ReportArgs};

/// Stereo matching by belief propagation: match pairs, evaluate maps, reproduce the thesis's tables.
#[derive(Debug, Parser)]
#[command(name = "bp", version, max_term_width = 110, after_help = AFTER_HELP)]
pub(crate) struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub(crate) command: Command,
}

const AFTER_HELP: &str = "\
Examples:
  bp match left.png right.png --output map.pfm --picture map.png
  bp match left.png right.png --output map.pfm --labels auto
  bp match left.png right.png --output map.png --algorithm bp --profile thesis --labels 112
  bp convert map.pfm --image left.png --points cloud.ply --calib calib.txt
  bp evaluate map.png truth.png --scale 2
  bp reproduce --quick
  bp doctor

Exit codes: 0 done, 1 other, 2 usage, 3 input, 4 the gate failed, 5 backend or device
unavailable or unable to run the plan, 6 out of memory, 130 interrupted.";

/// The commands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Compute the disparity map of a rectified pair.
    Match(Box<MatchArgs>),
    /// Make depth, points, a picture or another format of a disparity map that is there.
    Convert(Box<ConvertArgs>),
    /// Measure the errors of a disparity map against ground truth.
    Evaluate(EvaluateArgs),
    /// Run all algorithms on six scenes and write every table, chart and figure of the thesis beside its numbers.
    Reproduce(ReproduceArgs),
    /// Write the report of a recorded run again, or the part of a README that comes from it.
    Report(ReportArgs),
    /// List the scenes and check the files of a data folder.
    Scenes(ScenesArgs),
    /// List every device of every backend, by the names that --backend takes.
    Devices(DevicesArgs),
    /// Check what this machine has, and tell what is missing and which package brings it.
    Doctor(DoctorArgs),
    /// Check that backends give the reference's labels and messages, to the bit.
    Conform(ConformArgs),
    /// Time devices against each other on fixed problems, in turns and in one process.
    Speed(SpeedArgs),
    /// Check that speed-ups, accuracy, energy and memory are still what committed baselines say; exit code 4 where not.
    Gate(GateArgs),
    /// Set recorded runs of several machines, commits or backends beside one another.
    Compare(CompareArgs),
    /// Write a recorded run in the format of another program.
    Export(ExportArgs),
}

/// Which scenes.
#[derive(Debug, Args)]
pub(crate) struct DataArgs {
    /// Folder of the public data sets (see scripts/fetch-middlebury); without it the synthetic scenes run.
    // An empty variable means none, so it must not be refused as clap's own parser of paths would.
    #[arg(long, env = "BP_DATA", value_name = "DIR", value_parser = OsStringValueParser::new().map(PathBuf::from))]
    pub(crate) data: Option<PathBuf>,
    /// Run the synthetic scenes although there is a data folder.
    #[arg(long)]
    pub(crate) synthetic: bool,
}

/// `bp scenes`.
#[derive(Debug, Args)]
pub(crate) struct ScenesArgs {
    /// Which scenes.
    #[command(flatten)]
    pub(crate) data: DataArgs,
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

fn threads() -> impl TypedValueParser<Value = u16> {
    clap::value_parser!(u16).range(1..=1024)
}

fn positive(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("must be a number above 0".to_owned()),
    }
}

/// A parser of the names of `all`.
fn named<T: Copy + Send + Sync>(all: &'static [T], name: fn(T) -> &'static str) -> impl TypedValueParser<Value = T> {
    let names = PossibleValuesParser::new(all.iter().map(|&value| name(value)));
    names.try_map(move |text| all.iter().copied().find(|&value| name(value) == text).ok_or("not one of the names"))
}

fn switch(on: bool) -> &'static str {
    if on { "on" } else { "off" }
}
