//! Finds many pairs: in a list, in a folder with a known layout, or in the frames of a video.

mod list;
mod natural;
mod search;
mod video;

use std::{
    collections::BTreeMap,
    fmt,
    path::{Component, Path, PathBuf},
};

pub use list::parse;

use bp_io::is_folder;

use crate::{Error, Watch, reading::Room};

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

/// Bytes for each pair of a batch, apart from the letters of its paths: its entries in tables, the hashes of its files, and, when the
/// batch ends, why it failed or which settings it had.
const LISTED: u64 = 2 << 10;

/// The most bytes that a batch holds of these pairs, with its outputs in a folder of this name: their paths, and, of pairs that
/// fail, their paths again and a message with two more. [`LISTED`] counts the rest.
pub(crate) fn listed_bytes(pairs: &[Pair], output: &Path) -> u64 {
    let len = |path: &Path| path.as_os_str().len();
    let letters = |pair: &Pair| 3 * (len(&pair.left) + len(&pair.right)) + 4 * len(&pair.name) + 2 * len(output);
    pairs.iter().map(|pair| letters(pair) as u64 + LISTED).sum()
}

/// Pairs in order, notes on files that are not part of a pair, and what may hold more pairs but could not be read.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Found {
    /// The pairs.
    pub pairs: Vec<Pair>,
    /// The pairs that cannot be matched, by their place in `pairs`, and why.
    pub refused: BTreeMap<usize, String>,
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
    /// A list on standard input.
    StandardInput,
    /// Two patterns with one `%d`, `%04d` or `*` each, left and right.
    Video([String; 2]),
    /// Given pairs, and the name of their source for messages.
    Pairs(Vec<Pair>, String),
}

impl Source {
    /// Finds the pairs, at least one. The search of a folder skips `output`. A list that needs more than `max_memory` bytes, or
    /// more memory than is free, is refused before it is parsed.
    ///
    /// # Errors
    /// [`Error::Input`] if there is no pair or a list is broken, [`Error::Options`] for a pattern without a
    /// placeholder, [`Error::OutOfMemory`], [`Error::Stopped`].
    pub fn find(&self, output: &Path, max_memory: Option<u64>, watch: &Watch<'_>) -> Result<Found, Error> {
        let room = || Room::new(0, max_memory);
        let found = match self {
            Self::Path(path) => match is_folder(path).map_err(|error| bp_io::Error::reading(path, &error))? {
                true => search::search(path, output, watch)?,
                false => list::read(path, room(), watch)?,
            },
            Self::StandardInput => list::read_input(room(), watch)?,
            Self::Video([left, right]) => video::frames(left, right)?,
            Self::Pairs(pairs, _) => Found { pairs: pairs.clone(), ..Found::default() },
        };
        if found.pairs.is_empty() {
            let notes: String = found.unread.iter().chain(&found.notes).map(|note| format!("\n  {note}")).collect();
            return Err(Error::Input(format!("{self}: no pair found{notes}")));
        }
        Ok(found)
    }
}

/// Its name in messages.
impl fmt::Display for Source {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Path(path) => path.display().fmt(out),
            Self::StandardInput => out.write_str(list::INPUT),
            Self::Video([left, right]) => write!(out, "{left} and {right}"),
            Self::Pairs(_, name) => out.write_str(name),
        }
    }
}

/// The default name of a pair: the path of its left image without root, `..` and extension.
fn name_of(left: &Path) -> PathBuf {
    let below: PathBuf = left.components().filter(|part| matches!(part, Component::Normal(_))).collect();
    below.with_extension("")
}
