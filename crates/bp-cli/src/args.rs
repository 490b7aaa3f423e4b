//! The command line.

mod examples;
mod finishing;
mod many;
mod matching;
mod meaning;
mod measuring;
mod outputs;
mod records;

use std::path::PathBuf;

use clap::{
    Args, Parser, Subcommand,
    builder::{OsStringValueParser, PossibleValuesParser, TypedValueParser},
};

pub(crate) use finishing::FinishArgs;
pub(crate) use many::ManyArgs;
pub(crate) use matching::{EvaluateArgs, MatchArgs, PlanArgs, TruthArgs};
pub(crate) use measuring::{ConformArgs, GateArgs, ReproduceArgs, SpeedArgs};
pub(crate) use outputs::{ConvertArgs, OutputArgs};
pub(crate) use records::{CompareArgs, ExportArgs, ReportArgs};

/// Stereo matching by belief propagation: match pairs, evaluate maps, reproduce the thesis's tables.
#[derive(Debug, Parser)]
#[command(name = "bp", version, max_term_width = 110, after_help = examples::program())]
pub(crate) struct Cli {
    /// Tell errors only: no progress, notes or warnings.
    #[arg(long, short, global = true)]
    pub(crate) quiet: bool,
    /// What to do.
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Compute the disparity map of a rectified pair.
    #[command(after_help = examples::MATCH)]
    Match(Box<MatchArgs>),
    /// Make depth, points, a picture or another format of a disparity map that is there.
    #[command(after_help = examples::CONVERT)]
    Convert(Box<ConvertArgs>),
    /// Measure the errors of a disparity map against ground truth.
    #[command(after_help = examples::EVALUATE)]
    Evaluate(EvaluateArgs),
    /// Run all algorithms on six scenes and write every table, chart and figure of the thesis beside its numbers.
    #[command(after_help = examples::REPRODUCE)]
    Reproduce(ReproduceArgs),
    /// Write the report of a recorded run again, or the part of a README that comes from it.
    #[command(after_help = examples::REPORT)]
    Report(ReportArgs),
    /// List the scenes and check the files of a data folder.
    #[command(after_help = examples::SCENES)]
    Scenes(ScenesArgs),
    /// List every device of every backend, by the names that --backend takes.
    #[command(after_help = examples::DEVICES)]
    Devices(DevicesArgs),
    /// Check what this machine has, and tell what is missing and which package brings it.
    #[command(after_help = examples::DOCTOR)]
    Doctor(DoctorArgs),
    /// Check that backends give the reference's labels and messages, to the bit.
    #[command(after_help = examples::CONFORM)]
    Conform(ConformArgs),
    /// Time devices against each other on fixed problems, in turns and in one process.
    #[command(after_help = examples::SPEED)]
    Speed(SpeedArgs),
    /// Check that speed-ups, accuracy, energy and memory are still what committed baselines say; exit code 4 where not.
    #[command(after_help = examples::GATE)]
    Gate(GateArgs),
    /// Set recorded runs of several machines, commits or backends beside one another.
    #[command(after_help = examples::COMPARE)]
    Compare(CompareArgs),
    /// Write a recorded run in the format of another program.
    #[command(after_help = examples::EXPORT)]
    Export(ExportArgs),
    /// Print what makes a shell complete commands and options.
    #[command(after_help = examples::COMPLETIONS)]
    Completions(CompletionsArgs),
    /// Write man pages.
    #[command(after_help = examples::MAN)]
    Man(ManArgs),
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

impl DataArgs {
    /// The data folder, if the data comes from one.
    pub(crate) fn folder(&self) -> Option<PathBuf> {
        self.data.clone().filter(|folder| !folder.as_os_str().is_empty() && !self.synthetic)
    }
}

/// `bp scenes`.
#[derive(Debug, Args)]
pub(crate) struct ScenesArgs {
    /// Which scenes.
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
    /// The folder that bp.1, bp-match.1 and so on are written into.
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
