//! Arguments for matching many pairs with one command.

use std::path::PathBuf;

use clap::Args;

use bp_io::Layout;
use bp_stereo::batch::{Also, Shard};

use super::named;
use crate::failure::Failure;

/// Many pairs with one command.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Many pairs, video")]
pub(crate) struct ManyArgs {
    /// Match all pairs of a list or folder; --output is then a folder for their maps.
    ///
    /// A list has one pair per line: left image, right image and, optionally, a name for the map. Tabs separate them,
    /// else commas, else spaces ("..." around paths with spaces). - reads the list from standard input. A folder is
    /// searched recursively for view1 and view5, im2 and im6, im0 and im1, left and right, imL and imR, and for equal
    /// names in the folders left and right, image_2 and image_3, image_0 and image_1. Run the same command again to
    /// resume.
    #[arg(long, value_name = "LIST|DIR", group = "many")]
    pub(crate) pairs: Option<PathBuf>,
    /// Match the frames of a video: 'left/%04d.png' 'right/%04d.png'; --output is a folder.
    ///
    /// Each pattern has one %d or %04d for the frame number, or one * for any text. Quote patterns with *. Without them, frames are
    /// read from pipes or files of the format YUV4MPEG2 (.y4m), as ffmpeg -f yuv4mpegpipe writes it: one with both images in each
    /// frame (see --layout), or one for each camera; - is standard input. --output - then writes the maps one after another.
    #[arg(long, num_args = 1..=2, value_names = ["LEFT", "RIGHT"], group = "many")]
    pub(crate) video: Option<Vec<String>>,
    /// Where the images are in frames that hold both. [default: side-by-side]
    #[arg(long, value_parser = named(&Layout::ALL, Layout::name), hide_short_help = true)]
    pub(crate) layout: Option<Layout>,
    /// Extension of the maps, which selects their format. [default: pfm]
    ///
    /// Frames from pipes may become pfm, npy, or y4m for a coloured video.
    #[arg(long, value_name = "EXT", hide_short_help = true)]
    format: Option<String>,
    /// Other outputs for each pair, separated by commas.
    ///
    /// The files are NAME.picture.png, NAME.points.ply, and NAME.depth and NAME.confidence with the extension of
    /// --format.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = named(&Also::ALL, Also::name),
        hide_short_help = true)]
    pub(crate) also: Vec<Also>,
    /// Match only every N-th pair, starting with pair I. N processes, with I from 1 to N, share the work.
    #[arg(long, value_name = "I/N", hide_short_help = true)]
    pub(crate) shard: Option<Shard>,
    /// Start each frame from the messages of the previous frame, on the full grid only.
    ///
    /// This is faster, and as accurate where little moves. Every N-th frame starts cold; the frames up to the next cold
    /// start are matched and resumed together. Needs --schedule sync or checkerboard, for example --algorithm cfbp
    /// --half-steps 10. Excludes --check left-right and --also confidence, which match both views.
    #[arg(long, value_name = "N", num_args = 0..=1, require_equals = true, hide_short_help = true,
          default_missing_value = "30", value_parser = clap::value_parser!(u32).range(2..=1_000_000))]
    pub(crate) warm_start: Option<u32>,
    /// Match complete pairs again.
    #[arg(long, hide_short_help = true)]
    pub(crate) force: bool,
}

impl ManyArgs {
    /// The extension of the maps.
    pub(crate) fn format(&self) -> &str {
        self.format.as_deref().unwrap_or("pfm")
    }

    /// Refuses arguments that would do nothing. Clap's own sentence would not name them.
    pub(crate) fn check(&self) -> Result<(), Failure> {
        let is_video = self.video.is_some();
        let of_many = [
            (self.format.is_some(), "--format"),
            (!self.also.is_empty(), "--also"),
            (self.shard.is_some(), "--shard"),
            (self.force, "--force"),
        ];
        if let Some((_, option)) = of_many.into_iter().find(|&(given, _)| given && !is_video && self.pairs.is_none()) {
            return Err(Failure::usage(format!("{option} is for many pairs: give --pairs or --video, not two images")));
        }
        if self.layout.is_some() && !is_video {
            return Err(Failure::usage("--layout needs --video"));
        }
        if self.warm_start.is_some() && !is_video {
            return Err(Failure::usage("--warm-start needs --video: pairs of different scenes have nothing in common"));
        }
        Ok(())
    }
}
