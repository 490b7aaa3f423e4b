//! Finds many pairs: in a list, in a folder with a known layout, or in the frames of a video.

mod list;
mod natural;
mod search;
mod video;

use std::path::{Component, Path, PathBuf};

pub use list::parse;

use bp_io::{Contents, MOST_TEXT};

use crate::{Error, Watch};

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

/// Pairs in order, notes on files that are not part of a pair, and what may hold more pairs but could not be read.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Found {
    /// The pairs.
    pub pairs: Vec<Pair>,
    /// The notes, a line each.
    pub notes: Vec<String>,
    /// Folders that could not be read, and why, a line each.
    pub unread: Vec<String>,
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
    /// placeholder, [`Error::Stopped`].
    pub fn find(&self, output: &Path, watch: &Watch<'_>) -> Result<Found, Error> {
        let (found, source) = match self {
            Self::Path(path) if path.is_dir() => (search::search(path, output, watch)?, path.display().to_string()),
            Self::Path(path) => (listed(path, watch)?, path.display().to_string()),
            Self::Video([left, right]) => (video::frames(left, right)?, format!("{left} and {right}")),
            Self::Pairs(pairs, name) => (Found { pairs: pairs.clone(), ..Found::default() }, name.clone()),
        };
        if found.pairs.is_empty() {
            let notes: String = found.unread.iter().chain(&found.notes).map(|note| format!("\n  {note}")).collect();
            return Err(Error::Input(format!("{source}: no pair found{notes}")));
        }
        Ok(found)
    }
}

fn listed(path: &Path, watch: &Watch<'_>) -> Result<Found, Error> {
    let (name, path) = (path.display().to_string(), path.to_owned());
    let bytes = watch.unless_stopped(move || Contents::of(&path, MOST_TEXT))??.bytes;
    Ok(Found { pairs: parse(&bytes, &name)?, ..Found::default() })
}

/// The default name of a pair: the path of its left image without root, `..` and extension.
fn name_of(left: &Path) -> PathBuf {
    let below: PathBuf = left.components().filter(|part| matches!(part, Component::Normal(_))).collect();
    below.with_extension("")
}
