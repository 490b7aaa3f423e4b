//! Where the files of a batch are.

use std::path::{Path, PathBuf};

use super::{Also, BatchOptions, Shard};
use crate::{Making, Outputs, pairs::Pair};

/// The folder of the records, inside the output folder.
pub(super) const RECORDS: &str = "records";

/// Makes the paths of the files of each pair.
#[derive(Clone, Copy)]
pub(super) struct Places<'a> {
    pub(super) options: &'a BatchOptions,
    pub(super) making: &'a Making,
}

impl<'a> Places<'a> {
    pub(super) fn outputs(self, pair: &Pair) -> Outputs {
        let options = self.options;
        let named = |ending: &str| options.output.join(&pair.name).with_added_extension(ending);
        let also = |what: Also, ending: &str| options.also.contains(&what).then(|| named(ending));
        Outputs {
            map: Some(named(&options.format)),
            picture: also(Also::Picture, "picture.png"),
            depth: also(Also::Depth, &format!("depth.{}", options.format)),
            points: also(Also::Points, "points.ply"),
            confidence: also(Also::Confidence, &format!("confidence.{}", options.format)),
        }
    }

    pub(super) fn record(self, pair: &Pair) -> PathBuf {
        self.options.output.join(RECORDS).join(&pair.name).with_added_extension("json")
    }

    /// All files that are written for a pair.
    pub(super) fn files(self, pair: &Pair) -> impl Iterator<Item = PathBuf> + use<> {
        self.outputs(pair).paths(self.making).into_iter().chain([self.record(pair)])
    }

    /// The files that a pair is made from: the images, then the calibration.
    pub(super) fn inputs(self, pair: &'a Pair) -> Vec<&'a Path> {
        let calibration = self.making.calibration_files().into_iter();
        [pair.left.as_path(), &pair.right].into_iter().chain(calibration).collect()
    }

    /// The summary of all shards.
    pub(super) fn summary(self) -> PathBuf {
        Shard::default().summary_path(&self.options.output)
    }
}
