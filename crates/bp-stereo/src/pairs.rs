//! Finds many pairs: in a list, in a folder with a known layout, or in the frames of a video.

mod list;
mod natural;
mod search;
mod video;

use std::path::{Component, Path, PathBuf};

pub use list::parse;

use crate::Error;

/// A pair and its name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pair {
    /// The name of its outputs: a relative path without extension.
    pub name: PathBuf,
    /// The left image.
    pub left: PathBuf,
    /// The right image.
    pub right: PathBuf,
}

impl Pair {
    /// Both images, for messages.
    pub(crate) fn images(&self) -> String {
        format!("{} and {}", self.left.display(), self.right.display())
    }
}

/// Pairs in order, and notes on files that are not part of a pair.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Found {
    /// The pairs.
    pub pairs: Vec<Pair>,
    /// The notes, a line each.
    pub notes: Vec<String>,
}

/// Where pairs come from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// A list, or a folder that is searched.
    Path(PathBuf),
    /// Two patterns with one `%d`, `%04d` or `*` each, left and right.
    Video([String; 2]),
    /// Given pairs, and the name of their source for messages.
    Pairs(Vec<Pair>, String),
}

impl Source {
    /// Finds the pairs, at least one. The search of a folder skips `output`.
    ///
    /// # Errors
    /// [`Error::Input`] if there is no pair or a list is broken, [`Error::Options`] for a pattern without a
    /// placeholder.
    pub fn find(&self, output: &Path) -> Result<Found, Error> {
        let (found, source) = match self {
            Self::Path(path) if path.is_dir() => (search::search(path, output), path.display().to_string()),
            Self::Path(path) => (listed(path)?, path.display().to_string()),
            Self::Video([left, right]) => (video::frames(left, right)?, format!("{left} and {right}")),
            Self::Pairs(pairs, name) => (Found { pairs: pairs.clone(), notes: Vec::new() }, name.clone()),
        };
        if found.pairs.is_empty() {
            let notes: String = found.notes.iter().map(|note| format!("\n  {note}")).collect();
            return Err(Error::Input(format!("{source}: no pair found{notes}")));
        }
        Ok(found)
    }
}

fn listed(path: &Path) -> Result<Found, Error> {
    let bytes = std::fs::read(path).map_err(|error| bp_io::Error::reading(path, &error))?;
    Ok(Found { pairs: parse(&bytes, &path.display().to_string())?, notes: Vec::new() })
}

/// The default name of a pair: the path of its left image without root, `..` and extension.
fn name_of(left: &Path) -> PathBuf {
    let below: PathBuf = left.components().filter(|part| matches!(part, Component::Normal(_))).collect();
    below.with_extension("")
}
