//! Arguments for the outputs that are made from a disparity map.

use std::path::PathBuf;

use clap::Args;

use super::{named, positive};
use bp_io::{Colours, Limits};

/// The outputs that are made from a map.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Pictures, depth and points")]
pub(crate) struct OutputArgs {
    /// Write the map as a coloured picture.
    #[arg(long, value_name = "FILE.png")]
    pub(crate) picture: Option<PathBuf>,
    /// Write depth in millimetres; needs a calibration.
    ///
    /// .pfm, .tif and .npy hold 32-bit floats. .png holds 16-bit integers, with 0 for unknown or beyond 65535 mm.
    #[arg(long, value_name = "MAP", hide_short_help = true)]
    pub(crate) depth: Option<PathBuf>,
    /// Write a point cloud with the left image's colours; needs a calibration.
    ///
    /// Positions are in millimetres from the left camera: x right, y down, z forward.
    #[arg(long, value_name = "FILE.ply")]
    pub(crate) points: Option<PathBuf>,
    /// How the files are made.
    #[command(flatten)]
    pub(crate) making: MakingArgs,
}

/// How the files of every pair are made.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Pictures, depth and points")]
pub(crate) struct MakingArgs {
    /// Colours of the picture; unknown pixels are black. [default: viridis]
    #[arg(long, value_parser = named(&Colours::ALL, Colours::name), hide_short_help = true)]
    pub(crate) colours: Option<Colours>,
    /// Leave out the colour bar, which shows the disparity of each colour. The picture then has the map's size.
    #[arg(long, hide_short_help = true)]
    pub(crate) no_colour_bar: bool,
    /// Value of unknown pixels in .tif and .npy: plus infinity, or NaN as programs for photogrammetry expect; .pfm and .png
    /// have values of their own. [default: inf]
    #[arg(long, value_name = "inf|nan", value_parser = named(&[false, true], unknown), hide_short_help = true)]
    pub(crate) unknown: Option<bool>,
    /// Write the negative of each disparity, as programs do that count the right column minus the left one (MGM, s2p, Ames Stereo
    /// Pipeline, Pandora). Only maps have this sign.
    #[arg(long, hide_short_help = true)]
    pub(crate) negate: bool,
    /// Do not write the sidecar MAP.json, which describes scale, unit, range, plan and inputs of a map or picture.
    #[arg(long, hide_short_help = true)]
    pub(crate) no_sidecar: bool,
    /// Calibration of the cameras, by Middlebury, OpenCV, ROS, Kalibr or KITTI; give it twice for two files.
    ///
    /// Two files are those of the left and the right camera (ROS), or intrinsic and extrinsic parameters (OpenCV). Lengths in OpenCV's
    /// files are taken as millimetres.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["focal", "baseline", "doffs", "principal_point"])]
    pub(crate) calib: Vec<PathBuf>,
    /// Instead of --calib: focal length in pixels of these images.
    #[arg(long, value_name = "PX", requires = "baseline", allow_negative_numbers = true, value_parser = positive_double,
        hide_short_help = true)]
    pub(crate) focal: Option<f64>,
    /// Instead of --calib: distance between the cameras in millimetres.
    #[arg(long, value_name = "MM", requires = "focal", allow_negative_numbers = true, value_parser = positive_double,
        hide_short_help = true)]
    pub(crate) baseline: Option<f64>,
    /// Column of the right principal point minus that of the left one, in pixels. [default: 0]
    ///
    /// It is added to disparities to compute depth.
    #[arg(long, value_name = "PX", requires = "focal", allow_negative_numbers = true, value_parser = finite,
        hide_short_help = true)]
    pub(crate) doffs: Option<f64>,
    /// Column and row of the left principal point, from the centre of the first pixel. [default: the image's centre]
    #[arg(long, value_name = "X,Y", requires = "focal", allow_hyphen_values = true, value_parser = point,
        hide_short_help = true)]
    pub(crate) principal_point: Option<[f64; 2]>,
}

/// `bp convert`.
#[derive(Debug, Args)]
pub(crate) struct ConvertArgs {
    /// The disparity map: PFM, NPY or TIFF floats, or PNG, PGM or TIFF with 8 or 16 bits.
    pub(crate) map: PathBuf,
    /// Divide the map's stored values by N to get pixels; an integer 0 is unknown. [default: 1 for floats and 8 bits,
    /// 256 for 16 bits]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = positive)]
    pub(crate) map_scale: Option<f32>,
    /// The disparity map to write; its extension selects the format, as for bp match.
    #[arg(long, short, value_name = "MAP")]
    pub(crate) output: Option<PathBuf>,
    /// The left image, which gives --points its colours.
    #[arg(long, value_name = "LEFT")]
    pub(crate) image: Option<PathBuf>,
    /// Refuse images with more than N megapixels.
    #[arg(long, value_name = "N", default_value_t = Limits::MEGAPIXELS)]
    pub(crate) max_megapixels: u32,
    /// The other outputs.
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

/// The name of what marks unknown pixels: whether it is NaN.
fn unknown(nan: bool) -> &'static str {
    if nan { "nan" } else { "inf" }
}
