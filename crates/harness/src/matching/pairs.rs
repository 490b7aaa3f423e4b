//! Where many pairs come from: a list, a folder in which they lie in a known layout, or the frames of a video.

mod list;
mod natural;
mod search;
mod video;

use std::{
    io::Read,
    path::{Component, Path, PathBuf},
};

#[cfg(feature = "fuzzing")]
pub(crate) use list::parse;

use crate::{args::MatchArgs, failure::Failure};

/// A pair, and what its outputs are named after.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Pair {
    /// A relative path without ending.
    pub(crate) name: PathBuf,
    /// The left image.
    pub(crate) left: PathBuf,
    /// The right image.
    pub(crate) right: PathBuf,
}

/// Pairs in their order, and what is to be told of files that make none.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Found {
    /// The pairs.
    pub(crate) pairs: Vec<Pair>,
    /// A line each.
    pub(crate) notes: Vec<String>,
}

/// The pairs that the options ask for, at least one.
pub(crate) fn find(args: &MatchArgs) -> Result<Found, Failure> {
    let (found, source) = match (&args.many.pairs, args.many.video.as_deref()) {
        (Some(path), _) if path.is_dir() => (search::search(path, &args.output)?, path.display().to_string()),
        (Some(path), _) => (listed(path)?, path.display().to_string()),
        (None, Some([left, right])) => (video::frames(left, right)?, format!("{left} and {right}")),
        (None, _) => return Err(Failure::usage("--pairs or --video is missing")),
    };
    if found.pairs.is_empty() {
        let told: String = found.notes.iter().map(|note| format!("\n  {note}")).collect();
        return Err(Failure::input(format!("{source}: no pair is there; bp match --help tells where it looks{told}")));
    }
    Ok(found)
}

fn listed(path: &Path) -> Result<Found, Failure> {
    let mut bytes = Vec::new();
    let read = if path == Path::new("-") {
        std::io::stdin().lock().read_to_end(&mut bytes).map(drop)
    } else {
        std::fs::read(path).map(|contents| bytes = contents)
    };
    read.map_err(|error| Failure::reading(path, &error))?;
    Ok(Found { pairs: list::parse(&bytes, &path.display().to_string())?, notes: Vec::new() })
}

/// What a pair is named after that has no name of its own: the path of its left image without its root, steps up and
/// ending.
fn name_of(left: &Path) -> PathBuf {
    let below: PathBuf = left.components().filter(|part| matches!(part, Component::Normal(_))).collect();
    below.with_extension("")
}
