//! What is done to the map after matching.

use std::path::PathBuf;

use bp_core::finish::{Finish, MEDIANS};
use clap::Args;

use super::{named, switch};

/// What is done to the map after matching.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "After matching, in this order")]
pub(crate) struct FinishArgs {
    /// Match the right image too, and make unknown what the two maps do not agree on within a pixel: hidden pixels, and
    /// most wrong ones. Takes twice the time.
    #[arg(long, value_parser = named(&[()], |()| "left-right"))]
    pub(crate) check: Option<()>,
    /// Make unknown what belongs to a surface of fewer than N pixels.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) speckle: Option<u32>,
    /// Whether unknown pixels are filled from the row, by the farther one of the next surfaces. [default: on]
    #[arg(long, value_parser = named(&[true, false], switch))]
    pub(crate) fill: Option<bool>,
    /// Take the median of windows of N x N pixels: 3, 5 or 7.
    #[arg(long, value_name = "N", value_parser = named(&MEDIANS, side))]
    pub(crate) median: Option<usize>,
    /// Give fractions of disparities: the mean of those in a window of 9 x 9 that are within a pixel.
    #[arg(long)]
    pub(crate) subpixel: bool,
    /// Also write how far the map can be trusted, from 0 to 1: the share of 9 x 9 pixels that agree with their middle
    /// and with the right image's map, as matched; 0 where --check or --speckle made the disparity unknown, filled or
    /// not. .pfm, .tif and .npy as 32-bit floats, .png 65535 times them. Matches the right image too.
    #[arg(long, value_name = "MAP")]
    pub(crate) confidence: Option<PathBuf>,
}

impl FinishArgs {
    /// What is asked for.
    pub(crate) fn finish(&self) -> Finish {
        Finish {
            check: self.check.is_some(),
            speckles: self.speckle.map(|least| least as usize),
            fill: self.fill.unwrap_or(true) && (self.check.is_some() || self.speckle.is_some()),
            median: self.median,
            subpixel: self.subpixel,
        }
    }

    /// Whether the right image's map is needed.
    pub(crate) fn needs_right(&self) -> bool {
        self.check.is_some() || self.confidence.is_some()
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
