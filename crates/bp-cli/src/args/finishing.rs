//! Arguments for finishing the map after matching.

use std::path::PathBuf;

use bp_core::finish::MEDIANS;
use clap::Args;

use super::{named, switch};

/// The operations on the map after matching.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "After matching, in this order")]
pub(crate) struct FinishArgs {
    /// Drop pixels that fail a check: unique, left-right or off. [default: unique; with --quality best left-right; with fast off]
    ///
    /// unique: of pixels that match the same place of the right image, those that fit it less well are dropped, with small surfaces
    /// that are left and pixels whose match lies outside the image. left-right finds more wrong pixels. It also matches the right
    /// image: the two maps disagree, by more than one pixel, at occluded pixels and at most wrong ones. This takes half as long as
    /// the match, or as long where all labels are tried. Dropped pixels are filled, unless --fill off is given.
    #[arg(long, value_parser = named(&[Check::Unique, Check::LeftRight, Check::Off], Check::name))]
    pub(crate) check: Option<Check>,
    /// Keep whole pixels instead of refining disparities to fractions from the images.
    #[arg(long, hide_short_help = true)]
    pub(crate) whole_pixels: bool,
    /// Drop surfaces with fewer than N pixels.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), hide_short_help = true)]
    pub(crate) speckle: Option<u32>,
    /// Whether to fill dropped pixels. [default: on]
    ///
    /// They are filled from their row, with the farther of the two nearest surfaces. At the left border, the next surface
    /// is extended with its slope.
    #[arg(long, value_parser = named(&[true, false], switch), hide_short_help = true)]
    pub(crate) fill: Option<bool>,
    /// Apply a median filter of N x N pixels.
    #[arg(long, value_name = "N", value_parser = named(&MEDIANS, side))]
    pub(crate) median: Option<usize>,
    /// Write a confidence from 0 to 1 for each pixel.
    ///
    /// The confidence is about the probability that the disparity is right to one pixel. It follows from the share of a 9 x 9
    /// window that agrees with its centre and with the right image's map, as matched. A pixel that --check or --speckle dropped and
    /// that was filled has 0.56, and one that stays unknown 0. .pfm, .tif and .npy hold 32-bit floats, .png holds 65535 times
    /// the value. This option matches the right image too.
    #[arg(long, value_name = "MAP", hide_short_help = true)]
    pub(crate) confidence: Option<PathBuf>,
}

/// A check of the map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Check {
    /// Against the right image's map.
    LeftRight,
    /// Against other pixels of the same map.
    Unique,
    /// None.
    Off,
}

impl Check {
    fn name(self) -> &'static str {
        match self {
            Self::LeftRight => "left-right",
            Self::Unique => "unique",
            Self::Off => "off",
        }
    }
}

/// The name of a median's window, one of [`MEDIANS`].
fn side(side: usize) -> &'static str {
    match side {
        3 => "3",
        5 => "5",
        _ => "7",
    }
}
