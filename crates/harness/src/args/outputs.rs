//! What is written of a disparity map, and how.

use std::path::PathBuf;

use clap::Args;

use super::{named, positive};
use bp_io::{Colours, Limits};

/// What is made of a map.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Pictures, depth and points")]
pub(crate) struct OutputArgs {
    /// Write the map as a coloured picture.
    #[arg(long, value_name = "FILE.png")]
    pub(crate) picture: Option<PathBuf>,
    /// Write depth in millimetres: .pfm, .tif and .npy as 32-bit floats, .png in 16 bits (0 where unknown or beyond
    /// 65535 mm); needs a calibration.
    #[arg(long, value_name = "MAP")]
    pub(crate) depth: Option<PathBuf>,
    /// Write points with the left image's colours, in millimetres from the left camera, x right, y down, z forward;
    /// needs a calibration.
    #[arg(long, value_name = "FILE.ply")]
    pub(crate) points: Option<PathBuf>,
    /// How.
    #[command(flatten)]
    pub(crate) making: MakingArgs,
}

/// How files are made: the same for every pair.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Pictures, depth and points")]
pub(crate) struct MakingArgs {
    /// Colours of the picture; unknown pixels are black. [default: viridis]
    #[arg(long, value_parser = named(&Colours::ALL, Colours::name))]
    pub(crate) colours: Option<Colours>,
    /// Leave out the bar with the disparities of the colours, so that the picture has the map's size.
    #[arg(long)]
    pub(crate) no_colour_bar: bool,
    /// Write no MAP.json beside maps and pictures, which tells scale, unit, range, plan and inputs.
    #[arg(long)]
    pub(crate) no_sidecar: bool,
    /// Calibration of the pair as Middlebury has it (calib.txt: cam0, doffs, baseline, width, height).
    #[arg(long, value_name = "FILE", conflicts_with_all = ["focal", "baseline", "doffs", "principal_point"])]
    pub(crate) calib: Option<PathBuf>,
    /// In place of --calib: focal length in pixels of these images.
    #[arg(long, value_name = "PX", requires = "baseline", allow_negative_numbers = true, value_parser = positive_double)]
    pub(crate) focal: Option<f64>,
    /// In place of --calib: distance of the cameras in millimetres.
    #[arg(long, value_name = "MM", requires = "focal", allow_negative_numbers = true, value_parser = positive_double)]
    pub(crate) baseline: Option<f64>,
    /// Column of the right principal point less that of the left one, in pixels of these images; added to disparities
    /// before they give depth. [default: 0]
    #[arg(long, value_name = "PX", requires = "focal", allow_negative_numbers = true, value_parser = finite)]
    pub(crate) doffs: Option<f64>,
    /// Column and row of the left principal point, from the centre of the first pixel. [default: the middle]
    #[arg(long, value_name = "X,Y", requires = "focal", allow_hyphen_values = true, value_parser = point)]
    pub(crate) principal_point: Option<[f64; 2]>,
}

/// `bp convert`.
#[derive(Debug, Args)]
pub(crate) struct ConvertArgs {
    /// The disparity map: PFM, NPY or TIFF floats, or PNG, PGM or TIFF of 8 or 16 bits.
    pub(crate) map: PathBuf,
    /// What the map's stored values are divided by to give pixels; 0 is unknown where they are whole numbers.
    /// [default: floats 1, 8 bits 1, 16 bits 256]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = positive)]
    pub(crate) map_scale: Option<f32>,
    /// The disparity map to write: the ending says in which format, as for bp match.
    #[arg(long, short, value_name = "MAP")]
    pub(crate) output: Option<PathBuf>,
    /// The left image, whose colours --points takes.
    #[arg(long, value_name = "LEFT")]
    pub(crate) image: Option<PathBuf>,
    /// Refuse images of more megapixels.
    #[arg(long, value_name = "N", default_value_t = Limits::MEGAPIXELS)]
    pub(crate) max_megapixels: u32,
    /// What else is written, and how.
    #[command(flatten)]
    pub(crate) outputs: OutputArgs,
}

fn finite(text: &str) -> Result<f64, String> {
    text.trim().parse().ok().filter(|value: &f64| value.is_finite()).ok_or_else(|| "must be a number".to_owned())
}

fn positive_double(text: &str) -> Result<f64, String> {
    finite(text).ok().filter(|&value| value > 0.0).ok_or_else(|| "must be a number above 0".to_owned())
}

fn point(text: &str) -> Result<[f64; 2], String> {
    let numbers = text.split_once(',').and_then(|(x, y)| Some([finite(x).ok()?, finite(y).ok()?]));
    numbers.ok_or_else(|| "must be two numbers with a comma between them".to_owned())
}
