//! The files that are made of an answer.

use std::path::{Path, PathBuf};

use bp_core::Model;

use super::Answer;
use crate::{
    args::MatchArgs,
    failure::Failure,
    files::{check_distinct, check_png, check_range, check_writable, write_map, write_picture},
};

/// Where the files of one pair go.
pub(crate) struct Outputs {
    /// The disparity map.
    pub(crate) map: PathBuf,
    /// A coloured picture of it.
    pub(crate) picture: Option<PathBuf>,
}

impl Outputs {
    /// What the options ask for.
    pub(crate) fn of(args: &MatchArgs) -> Self {
        Self { map: args.output.clone(), picture: args.picture.clone() }
    }

    /// Fails where a file could not be written or would overwrite an input or another output; for telling so before the
    /// work is done.
    pub(crate) fn check(&self, inputs: &[&Path]) -> Result<(), Failure> {
        let outputs: Vec<&Path> = self.paths().collect();
        for (index, output) in outputs.iter().enumerate() {
            check_writable(output)?;
            for other in inputs.iter().chain(&outputs[..index]) {
                check_distinct(other, output)?;
            }
        }
        self.picture.as_deref().map_or(Ok(()), check_png)
    }

    /// Fails where a format cannot hold the disparities of a model.
    pub(crate) fn check_range(&self, model: &Model) -> Result<(), Failure> {
        check_range(&self.map, model.disparity(0), model.disparity(model.labels() as u16 - 1))
    }

    /// Writes all files.
    pub(crate) fn write(&self, answer: &Answer) -> Result<(), Failure> {
        write_map(&self.map, &answer.map)?;
        self.picture.as_deref().map_or(Ok(()), |picture| write_picture(picture, &answer.map))
    }

    /// All files.
    pub(crate) fn paths(&self) -> impl Iterator<Item = &Path> {
        std::iter::once(&self.map).chain(&self.picture).map(PathBuf::as_path)
    }
}
