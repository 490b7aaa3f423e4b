//! Checks that no file of a batch is in the way of another.
//!
//! The paths of all files may be hundreds of megabytes long, so only their hashes are kept. Where two are equal, the paths
//! themselves are compared.

use std::{
    collections::HashSet,
    hash::{BuildHasher as _, Hash as _, Hasher as _, RandomState},
    path::{Path, PathBuf},
    ptr,
};

use bp_io::resolved;

use super::places::Places;
use crate::{Error, Watch, pairs::Pair};

/// A set of files: 8 bytes for each.
#[derive(Default)]
pub(super) struct Hashes {
    hashes: HashSet<u64>,
    hasher: RandomState,
}

impl Hashes {
    /// Adds a file. Returns whether it is new.
    fn add(&mut self, path: &Path) -> bool {
        let hash = self.with_parents(path).last();
        hash.is_some_and(|hash| self.hashes.insert(hash))
    }

    pub(super) fn has(&self, path: &Path) -> bool {
        self.with_parents(path).last().is_some_and(|hash| self.hashes.contains(&hash))
    }

    /// Whether it has a folder above `path`.
    fn has_parent(&self, path: &Path) -> bool {
        let mut hashes = self.with_parents(path).peekable();
        while let Some(hash) = hashes.next() {
            if hashes.peek().is_some() && self.hashes.contains(&hash) {
                return true;
            }
        }
        false
    }

    /// The hashes of the folders above `path`, the uppermost first, and of itself.
    fn with_parents<'a>(&self, path: &'a Path) -> impl Iterator<Item = u64> + use<'a> {
        let mut hasher = self.hasher.build_hasher();
        path.components().map(move |part| {
            part.hash(&mut hasher);
            hasher.clone().finish()
        })
    }
}

/// Fails if two pairs, of any shards, would write the same file, if a file of one is a folder of another, or if an output would
/// overwrite an input. Returns all files that are read or written, each as its [`key`].
pub(super) fn check_apart(places: Places<'_>, pairs: &[Pair], watch: &Watch<'_>) -> Result<Hashes, Error> {
    Apart { places, pairs, watch }.check()
}

struct Apart<'a> {
    places: Places<'a>,
    pairs: &'a [Pair],
    watch: &'a Watch<'a>,
}

impl Apart<'_> {
    fn check(&self) -> Result<Hashes, Error> {
        let inputs = self.inputs()?;
        let mut files = Hashes::default();
        files.add(&key(&self.places.summary()));
        for pair in self.pairs {
            self.watch.check()?;
            for file in self.places.files(pair) {
                if inputs.has(&resolved(&file)) {
                    self.check_unread(&file)?;
                }
                if !files.add(&key(&file)) {
                    self.check_free(&file, pair)?;
                }
            }
        }
        for pair in self.pairs {
            self.watch.check()?;
            let below = self.places.files(pair).find(|file| files.has_parent(&key(file)));
            below.map_or(Ok(()), |file| self.check_free(&file, pair))?;
        }
        drop(inputs);
        self.pairs.iter().for_each(|pair| {
            self.each_input(pair, |input| {
                files.add(&key(&input));
            })
        });
        Ok(files)
    }

    fn inputs(&self) -> Result<Hashes, Error> {
        let mut inputs = Hashes::default();
        for pair in self.pairs {
            self.watch.check()?;
            self.each_input(pair, |input| {
                inputs.add(&input);
            });
        }
        Ok(inputs)
    }

    fn each_input(&self, pair: &Pair, take: impl FnMut(PathBuf)) {
        self.places.inputs(pair).into_iter().map(resolved).for_each(take);
    }

    /// Fails if a pair is made from this file.
    fn check_unread(&self, file: &Path) -> Result<(), Error> {
        let path = resolved(file);
        if !self.pairs.iter().flat_map(|pair| self.places.inputs(pair)).any(|input| resolved(input) == path) {
            return Ok(());
        }
        let what = format!("{} would be overwritten, which is read", file.display());
        Err(Error::Options(format!("{what}; choose another `output`")))
    }

    /// Fails if a file, or a folder above it, is the summary or a file of another pair.
    fn check_free(&self, file: &Path, pair: &Pair) -> Result<(), Error> {
        let (place, summary) = (key(file), self.places.summary());
        let others = self.pairs.iter().filter(|other| !ptr::eq(*other, pair));
        let others = others.flat_map(|other| self.places.files(other).map(|file| (file, other.left.as_path())));
        let mut others = [(summary, Path::new("the summary"))].into_iter().chain(others);
        let Some((other, owner)) = others.find(|(other, _)| place.starts_with(key(other))) else { return Ok(()) };
        let (owner, own) = (owner.display(), pair.left.display());
        let there = if key(&other) == place { file } else { &other };
        let what = format!("{}: {owner} and {own} would both go there", there.display());
        Err(Error::Options(format!("{what}; give them other names in a list of pairs")))
    }
}

/// The form in which paths are compared. Upper and lower case are equal, as on some file systems.
pub(super) fn key(path: &Path) -> PathBuf {
    path.as_os_str().to_ascii_lowercase().into()
}
