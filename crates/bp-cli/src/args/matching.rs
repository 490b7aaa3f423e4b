//! Arguments for matching and evaluating.

use std::path::PathBuf;

use bp_core::{Algorithm, MAX_SIDE, MAX_TRUNCATION, MessageStart, Profile, Schedule};
use bytesize::ByteSize;
use clap::{Args, builder::NonEmptyStringValueParser};

use bp_io::Limits;
use bp_stereo::{Labels, Quality, devices};

use super::{
    FinishArgs, ManyArgs, OutputArgs, named, positive, switch, threads,
    values::{AlignArg, align, labels},
};

/// `bp match`.
#[derive(Clone, Debug, Args)]
pub(crate) struct MatchArgs {
    /// The left image.
    ///
    /// PNG, PGM, PPM or TIFF with 8 or 16 bits, JPEG, or PFM with values from 0 to 1 or from 0 to 255 (others with
    /// --stretch); grey or colour. The camera's orientation tag (EXIF) is ignored.
    #[arg(required_unless_present = "many", conflicts_with = "many")]
    pub(crate) left: Option<PathBuf>,
    /// The right image of a rectified pair: same size, corresponding rows.
    #[arg(required_unless_present = "many", conflicts_with = "many")]
    pub(crate) right: Option<PathBuf>,
    /// The disparity map to write: .pfm, .tif, .npy or .png; - writes PFM to standard output.
    ///
    /// .pfm, .tif and .npy hold disparities in pixels as 32-bit floats. .png holds 256 times the disparity in 16 bits,
    /// where 0 means unknown and a disparity of 0 is stored as 1.
    #[arg(long, short, value_name = "MAP")]
    pub(crate) output: PathBuf,
    /// Print the report to standard output as JSON.
    #[arg(long)]
    pub(crate) json: bool,
    /// The images are raw: rectify them with --calib before matching. The map is that of the rectified left image.
    #[arg(long, requires = "calib", hide_short_help = true)]
    pub(crate) rectify: bool,
    /// Values have any range: stretch those of both images, by one scale, so that the 0.5 % darkest become black and the 0.5 % brightest
    /// white.
    ///
    /// For satellite and scientific images: 16 bits that are not used in full, and grey TIFF, NPY or PFM of floats. Where the left
    /// image has no value (NaN, or what a TIFF declares as missing), the map is unknown.
    #[arg(long, conflicts_with = "rectify", hide_short_help = true)]
    pub(crate) stretch: bool,
    /// Mask of the left image: an 8-bit image, 255 where it shows something. Elsewhere the map is unknown.
    #[arg(long, value_name = "MASK", conflicts_with_all = ["many", "rectify"], hide_short_help = true)]
    pub(crate) valid: Option<PathBuf>,
    /// Print a SHA-256 of all final messages: from the left, right, up and down, each `[row][column][label]`.
    #[arg(long, conflicts_with = "many", hide_short_help = true)]
    pub(crate) messages_hash: bool,
    /// Refuse images with more than N megapixels.
    #[arg(long, value_name = "N", default_value_t = Limits::MEGAPIXELS, hide_short_help = true)]
    pub(crate) max_megapixels: u32,
    /// Limit memory use, including images and answer; for example 2GiB. [default: the free memory]
    ///
    /// Larger pairs are matched in tiles. SIZE is in bytes, or has a unit: 512M and 2G use powers of 1000,
    /// 512MiB and 2GiB powers of 1024.
    #[arg(long, value_name = "SIZE", value_parser = memory, hide_short_help = true)]
    pub(crate) max_memory: Option<ByteSize>,
    /// Match the pair N times, and report the median time and the range (--json: every time).
    ///
    /// The first match is slower than the later ones. The frames of a video take as long as the later ones.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=10_000),
        conflicts_with = "many", hide_short_help = true)]
    pub(crate) repeat: u32,
    /// Ground truth of the left image, to measure errors against.
    #[arg(long, value_name = "MAP", help_heading = "Ground truth", conflicts_with = "many", hide_short_help = true)]
    pub(crate) ground_truth: Option<PathBuf>,
    /// Many pairs with one command.
    #[command(flatten)]
    pub(crate) many: ManyArgs,
    /// The operations on the map after matching.
    #[command(flatten)]
    pub(crate) finish: FinishArgs,
    /// The other outputs.
    #[command(flatten)]
    pub(crate) outputs: OutputArgs,
    /// The plan.
    #[command(flatten)]
    pub(crate) plan: PlanArgs,
    /// How ground truth is read.
    #[command(flatten)]
    pub(crate) truth: TruthArgs,
}

/// The plan.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Plan")]
pub(crate) struct PlanArgs {
    /// Number of disparities to search; must exceed the largest one. [default: auto]
    ///
    /// The largest disparity that can be found is the first one plus labels - 1. With auto, a coarse survey of the
    /// images finds the labels and the first disparity.
    #[arg(long, value_name = "N|auto", allow_negative_numbers = true, value_parser = labels)]
    pub(crate) labels: Option<Labels>,
    /// First disparity in pixels; may be negative. [default: with --labels auto what the survey finds, else 0]
    #[arg(long, value_name = "N", allow_negative_numbers = true, hide_short_help = true,
        value_parser = clap::value_parser!(i32).range(-(MAX_SIDE as i64)..=MAX_SIDE as i64))]
    pub(crate) min_disparity: Option<i32>,
    /// Whether to align the rows of the right image with those of the left one: auto, off or a camera's FILE.
    ///
    /// Rows of rectified images often differ by a few tenths of a pixel. auto measures this on the pair (on the first frames of
    /// a video) and resamples the right image, unless rows agree or too few points do. FILE holds the alignment of a
    /// camera; if it is missing, it is measured on this pair (on the first pairs of a batch) and written.
    #[arg(long, default_value = "auto", value_name = "auto|off|FILE", value_parser = align, hide_short_help = true)]
    pub(crate) align: AlignArg,
    /// What to trade for what: fast, balanced or best.
    ///
    /// fast keeps whole pixels and checks nothing. balanced fills most of what only the left camera sees from the surface behind.
    /// best finds more of it by the map of the right image, and matches colour images in colour; it takes about twice the
    /// time. Other options change single parts of it.
    #[arg(long, default_value = "balanced", value_parser = named(&Quality::ALL, Quality::name))]
    pub(crate) quality: Quality,
    /// Data cost and its default smoothness. [default: census16; for colour images with --quality best census32]
    #[arg(long, hide_short_help = true, value_parser = named(&Profile::ALL, Profile::name))]
    pub(crate) profile: Option<Profile>,
    /// Algorithm: sweep is ours, the others are the thesis's. [default: sweep]
    ///
    /// bp is plain belief propagation; cfbp is coarse-to-fine BP; cfcsbp is coarse-to-fine constant-space BP, with
    /// fewer loops; ctbp is census-transform BP, in four parts; ctcsbp is census-transform constant-space BP, in four
    /// parts with fewer loops.
    #[arg(long, value_parser = named(&Algorithm::ALL, Algorithm::name), hide_short_help = true)]
    pub(crate) algorithm: Option<Algorithm>,
    /// Backend: rayon, scalar (CPU), vulkan, wgpu (GPU); see bp devices.
    ///
    /// NAME:DEVICE selects a device other than the backend's first.
    #[arg(long, default_value = devices::DEFAULT, value_name = "NAME")]
    pub(crate) backend: String,
    /// Device of the backend: its index, a part of its name or the beginning of its UUID. [default: the first]
    #[arg(long, value_name = "DEVICE", value_parser = NonEmptyStringValueParser::new(), hide_short_help = true)]
    pub(crate) device: Option<String>,
    /// Threads of the backend rayon and, on every backend, of what follows matching. [default: RAYON_NUM_THREADS, else one per core]
    #[arg(long, value_name = "N", value_parser = threads(), hide_short_help = true)]
    pub(crate) threads: Option<u16>,
    /// Total loops (k), from which the algorithm derives those of each grid. [default: the number of labels; 1 for
    /// sweep]
    ///
    /// With --grids, and for sweep, N is the number of loops on each grid.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000), hide_short_help = true)]
    pub(crate) loops: Option<u32>,
    /// Half-steps of the schedule checkerboard on each grid.
    #[arg(long, value_name = "N", conflicts_with = "loops", value_parser = clap::value_parser!(u32).range(1..=2_000_000),
        hide_short_help = true)]
    pub(crate) half_steps: Option<u32>,
    /// Number of grids (pyramid levels). Needs --loops or --half-steps, except for sweep.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=bp_core::MAX_GRIDS as i64),
        hide_short_help = true)]
    pub(crate) grids: Option<u8>,
    /// Divisor of the total loops for cfcsbp and ctcsbp (Z'', Z''''). [default: 2]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), hide_short_help = true)]
    pub(crate) z: Option<u32>,
    /// Order of message updates. [default: sync; checkerboard with --half-steps; sweep has its own]
    #[arg(long, value_parser = named(&Schedule::ALL, Schedule::name), hide_short_help = true)]
    pub(crate) schedule: Option<Schedule>,
    /// Whether finer grids start with the messages that a parent received, or that the neighbour's parent sent.
    /// [default: receiver]
    #[arg(long, value_parser = named(&MessageStart::ALL, MessageStart::name), hide_short_help = true)]
    pub(crate) message_start: Option<MessageStart>,
    /// Whether to clip the data costs of coarse grids at K + K div 2. [default: on for sweep, else off]
    #[arg(long, value_parser = named(&[true, false], switch), hide_short_help = true)]
    pub(crate) coarse_clip: Option<bool>,
    /// Whether the finest grids try only the labels that the coarser ones make likely. [default: on for sweep from 32
    /// labels on, else off]
    ///
    /// This is faster and needs less memory. Needs the schedule sweep and at least three grids.
    #[arg(long, value_parser = named(&[true, false], switch), hide_short_help = true)]
    pub(crate) label_sets: Option<bool>,
    /// Whether to use the census match of the centre as a prior (ctbp, ctcsbp). [default: on]
    #[arg(long, value_parser = named(&[true, false], switch), hide_short_help = true)]
    pub(crate) seed_start: Option<bool>,
    /// Slope of the smoothness cost, in units of the data cost. [default: the profile's]
    ///
    /// With --slope or --truncation, all edges have the same smoothness cost, unless --edge-threshold is given too.
    #[arg(long, value_name = "N", allow_negative_numbers = true, hide_short_help = true)]
    pub(crate) slope: Option<u8>,
    /// Truncation K of the smoothness cost. [default: the profile's]
    #[arg(long, value_name = "K", allow_negative_numbers = true, hide_short_help = true,
        value_parser = clap::value_parser!(u8).range(0..=i64::from(MAX_TRUNCATION)))]
    pub(crate) truncation: Option<u8>,
    /// Let disparities jump where grey values differ by more than N: there, slope and truncation are halved. [default:
    /// the profile's levels]
    ///
    /// The profiles census16 and census32 have four levels of their own, which this replaces; the others have one. 255
    /// gives all edges the same smoothness cost.
    #[arg(long, value_name = "N", allow_negative_numbers = true, hide_short_help = true)]
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
    /// Ground truth of the right image, which shows the non-occluded pixels: those that both cameras see.
    #[arg(long, value_name = "MAP", conflicts_with = "mask", hide_short_help = true)]
    pub(crate) ground_truth_right: Option<PathBuf>,
    /// Mask of the non-occluded pixels: an 8-bit image in which they are 255.
    #[arg(long, value_name = "MAP", hide_short_help = true)]
    pub(crate) mask: Option<PathBuf>,
    /// Divide stored ground truth by N to get pixels; an integer 0 is unknown. [default: 1 for floats and 8 bits, 256
    /// for 16 bits]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = positive, hide_short_help = true)]
    pub(crate) scale: Option<f32>,
}

/// `bp evaluate`.
#[derive(Debug, Args)]
pub(crate) struct EvaluateArgs {
    /// The disparity map: PFM, NPY or TIFF floats, or PNG, PGM or TIFF with 8 or 16 bits.
    pub(crate) map: PathBuf,
    /// Ground truth, in the same formats.
    pub(crate) truth: PathBuf,
    /// Divide the map's stored values by N to get pixels; an integer 0 is unanswered. [default: as for --scale]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = positive)]
    pub(crate) map_scale: Option<f32>,
    /// Count pixels that are wrong by more than each of these, separated by commas.
    #[arg(long, value_name = "PX", value_delimiter = ',', default_values_t = bp_core::THRESHOLDS, value_parser = positive)]
    pub(crate) thresholds: Vec<f32>,
    /// Limit the map's disparities to 0 to PX first, as Middlebury's evaluation does.
    #[arg(long, value_name = "PX", value_parser = positive)]
    pub(crate) limit: Option<f32>,
    /// Fill the map's unanswered pixels first, with the smaller of the nearest answers in their row.
    #[arg(long)]
    pub(crate) fill: bool,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
    /// Refuse images with more than N megapixels.
    #[arg(long, value_name = "N", default_value_t = Limits::MEGAPIXELS)]
    pub(crate) max_megapixels: u32,
    /// How ground truth is read.
    #[command(flatten)]
    pub(crate) options: TruthArgs,
}
