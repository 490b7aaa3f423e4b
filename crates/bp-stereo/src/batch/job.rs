//! The work for each pair: its inputs, outputs and record, and checks before the work begins.

use std::{
    collections::{BTreeSet, HashSet},
    ffi::OsStr,
    fs::{self, DirEntry},
    io::ErrorKind,
    path::{Path, PathBuf},
    time::{Duration, SystemTime},
};

use super::{
    BatchOptions,
    apart::{Hashes, key},
    places::Places,
    record::{FileState, PairRecord, history},
};
use bp_io::{Files, MapFormat, create_folder, resolved};

use crate::{
    Error, Making, Outputs, Watch,
    pairs::{Found, Pair},
};

/// A temporary file this old is abandoned.
const ABANDONED: Duration = Duration::from_hours(1);

/// A pair and its place among the others. The paths of its files are made when they are needed: those of all pairs would fill
/// the memory.
pub(super) struct Job<'a> {
    pub(super) pair: &'a Pair,
    /// The index of its chain; see [`BatchOptions::chain`].
    pub(super) chain: usize,
    /// Why it cannot be matched, if its list says so.
    refused: Option<&'a str>,
    places: Places<'a>,
    /// The files of the whole batch.
    taken: &'a Hashes,
}

/// The jobs of the shard. `taken` are the files of all pairs.
pub(super) fn jobs<'a>(places: Places<'a>, found: &'a Found, taken: &'a Hashes) -> Vec<Job<'a>> {
    let job = |(index, pair)| {
        let refused = found.refused.get(&index).map(String::as_str);
        Job { pair, chain: index / places.options.chain(), refused, places, taken }
    };
    found.pairs.iter().enumerate().map(job).filter(|job| places.options.shard.has(job.chain)).collect()
}

impl Job<'_> {
    /// The two images.
    pub(super) fn images(&self) -> [&Path; 2] {
        [&self.pair.left, &self.pair.right]
    }

    /// The files that the outputs are made from.
    pub(super) fn inputs(&self) -> Vec<&Path> {
        self.places.inputs(self.pair)
    }

    pub(super) fn outputs(&self) -> Outputs {
        self.places.outputs(self.pair)
    }

    /// The paths of the outputs, in the order in which their states are recorded.
    pub(super) fn paths(&self) -> Vec<PathBuf> {
        self.outputs().paths(self.places.making)
    }

    pub(super) fn record(&self) -> PathBuf {
        self.places.record(self.pair)
    }

    /// Creates the folders of its files; fails if one of them cannot be written, or if the list refuses the pair.
    pub(super) fn check(&self, making: &Making) -> Result<(), Error> {
        if let Some(refused) = self.refused {
            return Err(Error::Input(refused.to_owned()));
        }
        for file in self.places.files(self.pair) {
            let Some(folder) = file.parent() else { continue };
            making.files.check_own(folder)?;
            create_folder(folder)?;
        }
        making.files.check_writable(&self.record())?;
        self.outputs().check(making, &self.inputs())
    }

    /// Removes files that an earlier run wrote and this run did not. Beside the new map they would seem to belong to
    /// it.
    pub(super) fn remove_others(&self) -> Result<(), Error> {
        let Some(earlier) = PairRecord::known(&self.record())? else { return Ok(()) };
        let written: HashSet<PathBuf> = self.paths().iter().map(|path| key(path)).collect();
        for path in self.earlier_outputs(&earlier) {
            let path = path?;
            if !written.contains(&key(&path)) {
                remove(&path)?;
            }
        }
        Ok(())
    }

    /// Removes the outputs of an earlier run from other images, after these images failed. Otherwise those outputs
    /// would seem to belong to these images.
    pub(super) fn remove_stale(&self, images: &[FileState]) {
        let Some(earlier) = PairRecord::read(&self.record()) else { return };
        if !images.is_empty() && !earlier.is_of_contents(images) {
            // If one cannot be removed, the next write to it reports why.
            let outputs = self.earlier_outputs(&earlier).flatten();
            outputs.chain([self.record()]).for_each(|path| drop(remove(&path)));
        }
    }

    /// The outputs that a record lists and that are unchanged, at their current paths. All outputs of a pair are in one
    /// folder, which may have been moved. A changed file of the same name may belong to the user; a record may be forged and
    /// name an image of the batch, or a file of another pair.
    fn earlier_outputs(&self, earlier: &PairRecord) -> impl Iterator<Item = Result<PathBuf, bp_io::Error>> {
        let paths = self.paths();
        let is_taken = |path: &Path| [path, &resolved(path)].iter().any(|path| self.taken.has(&key(path)));
        earlier.done.outputs.iter().filter_map(move |state| {
            let name = state.path.file_name().filter(|name| self.is_own(name))?;
            let here = paths.first()?.with_file_name(name);
            if !paths.contains(&here) && is_taken(&here) {
                return None;
            }
            state.compare(&here).map(|is_still| is_still.then_some(here)).transpose()
        })
    }

    /// Whether some options give an output of this pair this name. A record may be forged, and so name any file.
    fn is_own(&self, name: &OsStr) -> bool {
        let pair = self.pair.name.file_name().and_then(OsStr::to_str);
        let ending = name.to_str().zip(pair).and_then(|(name, pair)| name.strip_prefix(pair)?.strip_prefix('.'));
        let Some(ending) = ending.map(|ending| ending.strip_suffix(".json").unwrap_or(ending)) else { return false };
        let map = ["depth.", "confidence."].iter().find_map(|kind| ending.strip_prefix(kind)).unwrap_or(ending);
        MapFormat::named(map).is_some() || ["picture.png", "points.ply"].contains(&ending)
    }
}

/// Removes a file, if it is there.
fn remove(path: &Path) -> Result<(), bp_io::Error> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(bp_io::Error::writing(path, &error)),
        _ => Ok(()),
    }
}

/// Whether all pairs of a chain, given in order, are complete.
pub(super) fn are_complete(chain: &[Job<'_>], settings_sha256: &str) -> bool {
    let mut follows = None;
    chain.iter().all(|job| {
        let Some(record) = PairRecord::read(&job.record()) else { return false };
        let is_current = record.settings_sha256 == settings_sha256 && record.follows == follows;
        follows = Some(history(record.follows.as_deref(), &record.inputs));
        is_current && job.refused.is_none() && record.is_of(&job.images(), &job.paths())
    })
}

/// All folders that hold files of these jobs.
fn folders(options: &BatchOptions, jobs: &[Job<'_>]) -> BTreeSet<PathBuf> {
    let files = jobs.iter().flat_map(|job| job.places.files(job.pair));
    let mut folders: BTreeSet<PathBuf> = [options.output.clone()].into();
    for file in files {
        // Most folders hold many files.
        if let Some(folder) = file.parent().filter(|folder| !folders.contains(*folder)) {
            folders.insert(folder.to_owned());
        }
    }
    folders
}

/// Removes temporary files of a killed run of this shard, and abandoned ones of other shards. What cannot be removed, such as a
/// folder of that name, is no reason to match nothing.
pub(super) fn clear_leftovers(options: &BatchOptions, jobs: &[Job<'_>], files: &Files, watch: &Watch<'_>) {
    for folder in folders(options, jobs) {
        // A folder that is missing, or leads elsewhere, has no files of ours.
        let Some(entries) = files.check_own(&folder).ok().and_then(|()| fs::read_dir(&folder).ok()) else { continue };
        for entry in entries.flatten().filter(|entry| is_leftover(entry, files)) {
            // Another shard that started at the same time may have removed it first.
            if let Err(error) = remove(&entry.path()) {
                watch.warn(&format!("a temporary file of an earlier run stays: {error}"));
            }
        }
    }
}

fn is_leftover(entry: &DirEntry, files: &Files) -> bool {
    let name = entry.file_name();
    let is_old = || {
        let modified = entry.metadata().and_then(|metadata| metadata.modified()).ok();
        let age = modified.and_then(|modified| SystemTime::now().duration_since(modified).ok());
        age.is_some_and(|age| age > ABANDONED)
    };
    let is = |prefix: &str| name.as_encoded_bytes().starts_with(prefix.as_bytes());
    is(files.prefix()) || (is(Files::PREFIX) && is_old())
}
