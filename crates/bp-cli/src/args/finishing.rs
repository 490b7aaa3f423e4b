//! What is done to the map after matching.

use std::path::PathBuf;

use bp_core::finish::MEDIANS;
use clap::Args;

use super::{named, switch};

/// What is done to the map after matching.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "After matching, in this order")]
pub(crate) struct FinishArgs {
    /// Match the right image too, and drop pixels on which the two maps disagree.
    ///
    /// They disagree by more than a pixel at occluded pixels, and at most wrong ones. It takes twice the time. Dropped pixels
    /// are filled unless --fill off.
    #[arg(long, value_parser = named(&[()], |()| "left-right"))]
    pub(crate) check: Option<()>,
    /// Drop surfaces of fewer than N pixels.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), hide_short_help = true)]
    pub(crate) speckle: Option<u32>,
    /// Whether dropped pixels are filled from their row, by the farther one of the next surfaces. [default: on]
    #[arg(long, value_parser = named(&[true, false], switch), hide_short_help = true)]
    pub(crate) fill: Option<bool>,
    /// Take the median of N x N pixels.
    #[arg(long, value_name = "N", value_parser = named(&MEDIANS, side))]
    pub(crate) median: Option<usize>,
    /// Give fractions of disparities: the mean of those in 9 x 9 pixels that lie within a pixel.
    #[arg(long, hide_short_help = true)]
    pub(crate) subpixel: bool,
    /// Write a confidence from 0 to 1 for each pixel.
    ///
    /// It is the share of 9 x 9 pixels that agree with their middle and with the right image's map, as matched; 0 where
    /// --check or --speckle dropped the pixel, filled or not. .pfm, .tif and .npy hold 32-bit floats, .png 65535 times them.
    /// Matches the right image too.
    #[arg(long, value_name = "MAP", hide_short_help = true)]
    pub(crate) confidence: Option<PathBuf>,
}

/// The name of a median's window, one of [`MEDIANS`].
fn side(side: usize) -> &'static str {
    match side {
        3 => "3",
        5 => "5",
        _ => "7",
    }
}
