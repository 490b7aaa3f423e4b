//! Matching and evaluating.

use std::path::PathBuf;

use bp_core::{Algorithm, MAX_SIDE, MAX_TRUNCATION, MessageStart, Profile, Schedule};
use bytesize::ByteSize;
use clap::{Args, builder::NonEmptyStringValueParser};

use bp_io::Limits;
use bp_stereo::Labels;

use super::{FinishArgs, ManyArgs, OutputArgs, meaning::labels, named, positive, switch, threads};
use crate::backends;

/// `bp match`.
#[derive(Clone, Debug, Args)]
pub(crate) struct MatchArgs {
    /// The left image: PNG, PGM, PPM or TIFF of 8 or 16 bits, JPEG, or PFM (0 to 1 or to 255), grey or colour; a noted
    /// orientation (EXIF) is ignored.
    #[arg(required_unless_present = "many", conflicts_with = "many")]
    pub(crate) left: Option<PathBuf>,
    /// The right image, of the same size; rows must correspond (a rectified pair).
    #[arg(required_unless_present = "many", conflicts_with = "many")]
    pub(crate) right: Option<PathBuf>,
    /// The disparity map to write: .pfm, .tif and .npy hold disparities in pixels as 32-bit floats, .png 256 times them
    /// in 16 bits (a disparity of 0 as 1, since 0 is unknown).
    #[arg(long, short, value_name = "MAP")]
    pub(crate) output: PathBuf,
    /// Print everything as JSON on standard output.
    #[arg(long)]
    pub(crate) json: bool,
    /// Print a SHA-256 of all final messages: from the left, right, up and down, each `[row][column][label]`.
    #[arg(long, conflicts_with = "many")]
    pub(crate) messages_hash: bool,
    /// Refuse images of more megapixels.
    #[arg(long, value_name = "N", default_value_t = Limits::MEGAPIXELS)]
    pub(crate) max_megapixels: u32,
    /// Keep within so much memory, images and answer included: larger pairs are matched strip by strip or tile by tile.
    /// Bytes, or 512M, 2G (powers of 1000), 512MiB, 2GiB (of 1024). [default: what is free]
    #[arg(long, value_name = "SIZE", value_parser = memory)]
    pub(crate) max_memory: Option<ByteSize>,
    /// Match the pair so many times and tell the median time and the range (--json: each): the first ones are slower, a
    /// video is like the later ones.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=10_000), conflicts_with = "many")]
    pub(crate) repeat: u32,
    /// Ground truth of the left image: errors are measured where it is given.
    #[arg(long, value_name = "MAP", help_heading = "Ground truth", conflicts_with = "many")]
    pub(crate) ground_truth: Option<PathBuf>,
    /// Many pairs with one command.
    #[command(flatten)]
    pub(crate) many: ManyArgs,
    /// What is done to the map after matching.
    #[command(flatten)]
    pub(crate) finish: FinishArgs,
    /// What else is written, and how.
    #[command(flatten)]
    pub(crate) outputs: OutputArgs,
    /// What to run.
    #[command(flatten)]
    pub(crate) plan: PlanArgs,
    /// How ground truth is read.
    #[command(flatten)]
    pub(crate) truth: TruthArgs,
}

/// What to run.
#[derive(Clone, Debug, Args)]
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
    /// Number of labels; the largest disparity is the least plus labels - 1. auto takes labels and least disparity from
    /// a coarse look at the images. [default: a quarter of the width, rounded up to a multiple of 16]
    #[arg(long, value_name = "N|auto", allow_negative_numbers = true, value_parser = labels)]
    pub(crate) labels: Option<Labels>,
    /// Disparity of the first label in pixels; may be negative. [default: 0; with --labels auto what the images need]
    #[arg(long, value_name = "N", allow_negative_numbers = true,
        value_parser = clap::value_parser!(i32).range(-(MAX_SIDE as i64)..=MAX_SIDE as i64))]
    pub(crate) min_disparity: Option<i32>,
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
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub(crate) slope: Option<u8>,
    /// Truncation K of the smoothness cost. [default: the profile's]
    #[arg(long, value_name = "K", allow_negative_numbers = true,
        value_parser = clap::value_parser!(u8).range(0..=i64::from(MAX_TRUNCATION)))]
    pub(crate) truncation: Option<u8>,
    /// Weak edges: half slope and truncation where neighbouring grey values of the left image differ by more than N.
    /// [default: no edge is weak]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u8).range(0..=254))]
    pub(crate) edge_threshold: Option<u8>,
}

fn memory(text: &str) -> Result<ByteSize, String> {
    let whole_or_with_unit = text.parse().ok().filter(|_| text.starts_with(|c: char| c.is_ascii_digit()));
    whole_or_with_unit.ok_or_else(|| "must be a number of bytes, or such as 512M, 2G, 512MiB, 2GiB".to_owned())
}

/// How ground truth is read.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Ground truth")]
pub(crate) struct TruthArgs {
    /// Ground truth of the right image: tells which pixels both cameras see.
    #[arg(long, value_name = "MAP", conflicts_with = "mask")]
    pub(crate) ground_truth_right: Option<PathBuf>,
    /// Pixels that both cameras see: an 8-bit image, 255 where they do.
    #[arg(long, value_name = "MAP")]
    pub(crate) mask: Option<PathBuf>,
    /// What stored ground truth is divided by to give pixels; 0 is unknown. [default: floats 1, 8 bits 1, 16 bits 256]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = positive)]
    pub(crate) scale: Option<f32>,
}

/// `bp evaluate`.
#[derive(Debug, Args)]
pub(crate) struct EvaluateArgs {
    /// The disparity map: PFM, NPY or TIFF floats, or PNG, PGM or TIFF of 8 or 16 bits.
    pub(crate) map: PathBuf,
    /// Ground truth, in the same formats.
    pub(crate) truth: PathBuf,
    /// What the map's stored values are divided by to give pixels; 0 is unanswered. [default: as for --scale]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = positive)]
    pub(crate) map_scale: Option<f32>,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
    /// Refuse images of more megapixels.
    #[arg(long, value_name = "N", default_value_t = Limits::MEGAPIXELS)]
    pub(crate) max_megapixels: u32,
    /// How ground truth is read.
    #[command(flatten)]
    pub(crate) options: TruthArgs,
}
