//! The command line.

use std::path::PathBuf;

use bp_core::{Algorithm, MAX_LABELS, MAX_TRUNCATION, MessageStart, Profile, Schedule, image::MAX_SIDE};
use bytesize::ByteSize;
use clap::{
    Args, Parser, Subcommand,
    builder::{NonEmptyStringValueParser, OsStringValueParser, PossibleValuesParser, TypedValueParser},
};

use crate::{backends, export::Format, files::PixelLimit, speed::Problem};

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
  bp match left.png right.png --output map.png --algorithm bp --profile thesis --labels 112
  bp evaluate map.png truth.png --scale 2
  bp reproduce --quick
  bp doctor

Exit codes: 0 done, 1 other, 2 usage, 3 input, 5 backend or device unavailable or unable
to run the plan, 6 out of memory, 130 interrupted.";

/// The commands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Compute the disparity map of a rectified pair.
    Match(Box<MatchArgs>),
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
    /// Set recorded runs of several machines, commits or backends beside one another.
    Compare(CompareArgs),
    /// Write a recorded run in the format of another program.
    Export(ExportArgs),
}

/// `bp match`.
#[derive(Debug, Args)]
pub(crate) struct MatchArgs {
    /// The left image: PNG, PGM or PPM of 8 or 16 bits, grey or colour.
    pub(crate) left: PathBuf,
    /// The right image, of the same size; rows must correspond (a rectified pair).
    pub(crate) right: PathBuf,
    /// The disparity map to write: .pfm holds disparities in pixels, .png 256 times them in 16 bits (a disparity of
    /// 0 as 1, since 0 is unknown).
    #[arg(long, short, value_name = "MAP")]
    pub(crate) output: PathBuf,
    /// Also write the map as a coloured picture.
    #[arg(long, value_name = "FILE.png")]
    pub(crate) picture: Option<PathBuf>,
    /// Print everything as JSON on standard output.
    #[arg(long)]
    pub(crate) json: bool,
    /// Print a SHA-256 of all final messages: from the left, right, up and down, each `[row][column][label]`.
    #[arg(long)]
    pub(crate) messages_hash: bool,
    /// Refuse images of more megapixels.
    #[arg(long, value_name = "N", default_value_t = PixelLimit::MEGAPIXELS)]
    pub(crate) max_megapixels: u32,
    /// Refuse plans that need more memory, or run a smaller one where no option of the plan's shape was given:
    /// bytes, or 512M, 2G (powers of 1000), 512MiB, 2GiB (of 1024).
    #[arg(long, value_name = "SIZE")]
    pub(crate) max_memory: Option<ByteSize>,
    /// Match the pair so many times and tell the time of each: the first ones are slower, a video is like the
    /// later ones.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub(crate) repeat: u32,
    /// Ground truth of the left image: errors are measured where it is given.
    #[arg(long, value_name = "MAP", help_heading = "Ground truth")]
    pub(crate) ground_truth: Option<PathBuf>,
    /// What to run.
    #[command(flatten)]
    pub(crate) plan: PlanArgs,
    /// How ground truth is read.
    #[command(flatten)]
    pub(crate) truth: TruthArgs,
}

/// What to run.
#[derive(Debug, Args)]
#[command(next_help_heading = "Plan")]
pub(crate) struct PlanArgs {
    /// Algorithm: one of the thesis's five, or sweep, which is ours. [default: sweep]
    #[arg(long, value_parser = named(&Algorithm::ALL, Algorithm::name))]
    pub(crate) algorithm: Option<Algorithm>,
    /// Data cost, with the smoothness that goes with it.
    #[arg(long, default_value = "census", value_parser = named(&Profile::ALL, Profile::name))]
    pub(crate) profile: Profile,
    /// Backend; NAME:DEVICE for another than its first device.
    #[arg(long, default_value = backends::DEFAULT, value_name = "NAME")]
    pub(crate) backend: String,
    /// Device of the backend, as `bp devices` lists them: its index, a part of its name or the beginning of its UUID.
    /// [default: its first]
    #[arg(long, value_name = "DEVICE", value_parser = NonEmptyStringValueParser::new())]
    pub(crate) device: Option<String>,
    /// Threads of the backend rayon. [default: RAYON_NUM_THREADS, else one a processor]
    #[arg(long, value_name = "N", value_parser = threads())]
    pub(crate) threads: Option<u16>,
    /// Number of labels; the largest disparity is the least plus labels - 1. [default: a quarter of the width, rounded
    /// up to a multiple of 16]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=MAX_LABELS as i64))]
    pub(crate) labels: Option<u16>,
    /// Disparity of the first label in pixels; may be negative.
    #[arg(long, value_name = "N", default_value_t = 0, allow_negative_numbers = true,
        value_parser = clap::value_parser!(i32).range(-(MAX_SIDE as i64)..=MAX_SIDE as i64))]
    pub(crate) min_disparity: i32,
    /// Loops (k) that the algorithm derives its own from; with --grids or sweep, loops on each grid. [default: labels;
    /// 1 for sweep]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(crate) loops: Option<u32>,
    /// Half-steps on each grid, divided by nothing (schedule checkerboard).
    #[arg(long, value_name = "N", conflicts_with = "loops", value_parser = clap::value_parser!(u32).range(1..=2_000_000))]
    pub(crate) half_steps: Option<u32>,
    /// Number of grids, coarse to fine; except for sweep it needs --loops or --half-steps, which then count on each
    /// grid.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=bp_core::MAX_GRIDS as i64))]
    pub(crate) grids: Option<u8>,
    /// What cfcsbp and ctcsbp divide the loops by (Z'', Z''''). [default: 2]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) z: Option<u32>,
    /// Order of message updates. [default: sync; checkerboard with --half-steps; algorithm sweep has its own]
    #[arg(long, value_parser = named(&Schedule::ALL, Schedule::name))]
    pub(crate) schedule: Option<Schedule>,
    /// By which side finer grids take over messages. [default: receiver]
    #[arg(long, value_parser = named(&MessageStart::ALL, MessageStart::name))]
    pub(crate) message_start: Option<MessageStart>,
    /// Whether the data costs of coarse grids are clipped at K + K div 2. [default: on for sweep, else off]
    #[arg(long, value_parser = named(&[true, false], switch))]
    pub(crate) coarse_clip: Option<bool>,
    /// Whether the census match of the centre is a prior (ctbp, ctcsbp). [default: on]
    #[arg(long, value_parser = named(&[true, false], switch))]
    pub(crate) seed_start: Option<bool>,
    /// Slope of the smoothness cost, in units of the data cost. [default: the profile's]
    #[arg(long, value_name = "N")]
    pub(crate) slope: Option<u8>,
    /// Truncation K of the smoothness cost. [default: the profile's]
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u8).range(0..=i64::from(MAX_TRUNCATION)))]
    pub(crate) truncation: Option<u8>,
}

impl PlanArgs {
    /// The algorithm.
    pub(crate) fn algorithm(&self) -> Algorithm {
        self.algorithm.unwrap_or(Algorithm::Sweep)
    }
}

/// How ground truth is read.
#[derive(Debug, Args)]
#[command(next_help_heading = "Ground truth")]
pub(crate) struct TruthArgs {
    /// Ground truth of the right image: tells which pixels both cameras see.
    #[arg(long, value_name = "MAP", conflicts_with = "mask")]
    pub(crate) ground_truth_right: Option<PathBuf>,
    /// Pixels that both cameras see: an 8-bit image, 255 where they do.
    #[arg(long, value_name = "MAP")]
    pub(crate) mask: Option<PathBuf>,
    /// What stored ground truth is divided by to give pixels; 0 is unknown. [default: PFM 1, 8 bits 1, 16 bits 256]
    #[arg(long, value_name = "N", value_parser = positive)]
    pub(crate) scale: Option<f32>,
}

/// `bp evaluate`.
#[derive(Debug, Args)]
pub(crate) struct EvaluateArgs {
    /// The disparity map.
    pub(crate) map: PathBuf,
    /// Ground truth.
    pub(crate) truth: PathBuf,
    /// What the map's stored values are divided by to give pixels; 0 is unanswered. [default: as for --scale]
    #[arg(long, value_name = "N", value_parser = positive)]
    pub(crate) map_scale: Option<f32>,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
    /// Refuse images of more megapixels.
    #[arg(long, value_name = "N", default_value_t = PixelLimit::MEGAPIXELS)]
    pub(crate) max_megapixels: u32,
    /// How ground truth is read.
    #[command(flatten)]
    pub(crate) options: TruthArgs,
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
    #[arg(long, value_delimiter = ',', default_value = backends::DEFAULT, value_name = "NAMES")]
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

/// `bp report`.
#[derive(Debug, Args)]
pub(crate) struct ReportArgs {
    /// A recorded run: the folder of a record.json.
    pub(crate) run: PathBuf,
    /// Instead of the report, write the run's chart and table between the markers of this file.
    #[arg(long, value_name = "README.md")]
    pub(crate) readme: Option<PathBuf>,
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

/// `bp conform`.
#[derive(Debug, Args)]
pub(crate) struct ConformArgs {
    /// Backends, separated by commas; NAME:DEVICE for another than a backend's first device.
    #[arg(long, value_delimiter = ',', default_value = backends::DEFAULT, value_name = "NAMES")]
    pub(crate) backend: Vec<String>,
}

/// `bp speed`.
#[derive(Debug, Args)]
pub(crate) struct SpeedArgs {
    /// Backends, separated by commas, the one first that the others are compared with; NAME:DEVICE for another than a
    /// backend's first device.
    #[arg(long, value_delimiter = ',', default_value = backends::DEFAULT, value_name = "NAMES")]
    pub(crate) backend: Vec<String>,
    /// Problems, separated by commas; pixels, labels and loops are families of problems in which that number grows.
    /// [default: all]
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

/// `bp compare`.
#[derive(Debug, Args)]
pub(crate) struct CompareArgs {
    /// Recorded runs of the same images, L and k: each a record.json or its folder. The others are compared with the
    /// first.
    #[arg(required = true, num_args = 2.., value_name = "RECORD")]
    pub(crate) records: Vec<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// `bp export`.
#[derive(Debug, Args)]
pub(crate) struct ExportArgs {
    /// A recorded run: a record.json or its folder.
    pub(crate) record: PathBuf,
    /// Format: input of github-action-benchmark (customSmallerIsBetter) or Bencher (Bencher Metric Format), a table
    /// with a row for every sample, or a Vega-Lite chart.
    #[arg(long, value_parser = named(&Format::ALL, Format::name))]
    pub(crate) format: Format,
    /// The file to write. [default: standard output]
    #[arg(long, short, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
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
