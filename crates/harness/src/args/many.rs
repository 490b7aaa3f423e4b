//! Many pairs with one command.

use std::path::PathBuf;

use clap::Args;

use bp_stereo::batch::{Also, Shard};

use super::named;

/// Many pairs with one command.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Many pairs, video")]
pub(crate) struct ManyArgs {
    /// Match all pairs of a list or folder; --output is then a folder for their maps. A list has a pair a line: left,
    /// right and, if the map shall not be named after the left image, a name; between them tabs, or else commas, or else
    /// spaces ("..." around what holds some); - is standard input. A folder is searched, with those below it, for
    /// view1 and view5, im2 and im6, im0 and im1, left and right, imL and imR, and for equal names in the folders left
    /// and right, image_2 and image_3, image_0 and image_1.
    #[arg(long, value_name = "LIST|DIR", group = "many")]
    pub(crate) pairs: Option<PathBuf>,
    /// Match the frames of a video; --output is then a folder for their maps. In each pattern one %d (or %04d) stands
    /// for a number, or one * for anything: 'left/%04d.png' 'right/%04d.png'. Quote patterns with *.
    #[arg(long, num_args = 2, value_names = ["LEFT", "RIGHT"], group = "many")]
    pub(crate) video: Option<Vec<String>>,
    /// Ending of the maps, which says how disparities are stored: as that of --output does for one pair.
    #[arg(long, value_name = "ENDING", default_value = "pfm", requires = "many")]
    pub(crate) format: String,
    /// What else is written of every pair, separated by commas: picture (NAME.picture.png), points (NAME.points.ply),
    /// depth and confidence (NAME.depth and NAME.confidence with the ending of --format).
    #[arg(long, value_name = "NAMES", value_delimiter = ',', requires = "many", value_parser = named(&Also::ALL, Also::name))]
    pub(crate) also: Vec<Also>,
    /// Match only every N-th pair, from the I-th on: N processes with I from 1 to N share the work.
    #[arg(long, value_name = "I/N", requires = "many")]
    pub(crate) shard: Option<Shard>,
    /// Start the messages of each frame from those of the frame before, on the full grid alone: faster, and as accurate
    /// where little moves. Every N-th frame starts anew; from it to the next such one frames are matched or resumed
    /// together. Needs --schedule sync or checkerboard, as --algorithm cfbp --half-steps 10 has, and one view: no
    /// --check, no --also confidence.
    #[arg(long, value_name = "N", requires = "video", num_args = 0..=1, require_equals = true,
          default_missing_value = "30", value_parser = clap::value_parser!(u32).range(2..=1_000_000))]
    pub(crate) warm_start: Option<u32>,
    /// Match pairs again that are complete.
    #[arg(long, requires = "many")]
    pub(crate) force: bool,
}
