//! Where many pairs come from: a list, a folder in which they lie in a known layout, or the frames of a video.

mod list;
mod natural;
mod search;
mod video;

use std::path::{Component, Path, PathBuf};

pub use list::parse;

use crate::Error;

/// A pair, and what its outputs are named after.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pair {
    /// A relative path without ending.
    pub name: PathBuf,
    /// The left image.
    pub left: PathBuf,
    /// The right image.
    pub right: PathBuf,
}

/// Pairs in their order, and what is to be told of files that make none.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Found {
    /// The pairs.
    pub pairs: Vec<Pair>,
    /// A line each.
    pub notes: Vec<String>,
}

/// Where pairs are looked for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// A list, or a folder that is searched.
    Path(PathBuf),
    /// Two patterns with one `%d`, `%04d` or `*` each, left and right.
    Video([String; 2]),
    /// These pairs; messages call where they are from by this name.
    Pairs(Vec<Pair>, String),
}

impl Source {
    /// The pairs, at least one. What lies in `output` is none.
    ///
    /// # Errors
    /// [`Error::Input`] where there is no pair or a list is broken, [`Error::Options`] for a pattern without a place.
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

/// What a pair is named after that has no name of its own: the path of its left image without its root, steps up and
/// ending.
fn name_of(left: &Path) -> PathBuf {
    let below: PathBuf = left.components().filter(|part| matches!(part, Component::Normal(_))).collect();
    below.with_extension("")
}
