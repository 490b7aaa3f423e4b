//! Arguments for rectifying.

use std::path::PathBuf;

use bp_io::Limits;
use clap::Args;

/// `bp rectify`.
#[derive(Debug, Args)]
pub(crate) struct RectifyArgs {
    /// The raw image of the left camera.
    pub(crate) left: PathBuf,
    /// The raw image of the right camera: same size.
    pub(crate) right: PathBuf,
    /// Calibration of both cameras, by OpenCV, ROS, Kalibr or KITTI; give it twice for two files.
    ///
    /// Two files are those of the left and the right camera (ROS), or intrinsic and extrinsic parameters (OpenCV).
    #[arg(long, value_name = "FILE", required = true)]
    pub(crate) calib: Vec<PathBuf>,
    /// The folder to write left.png, right.png, calib.txt and rectification.json (R1, R2, P1, P2, Q) into.
    #[arg(long, short, value_name = "FOLDER")]
    pub(crate) output: PathBuf,
    /// Refuse images with more than N megapixels.
    #[arg(long, value_name = "N", default_value_t = Limits::MEGAPIXELS)]
    pub(crate) max_megapixels: u32,
}
