//! The work for each pair: its inputs, outputs and record, and checks before the work begins.

use std::{
    collections::{BTreeSet, HashSet},
    ffi::OsStr,
    fs,
    hash::{BuildHasher, RandomState},
    io::ErrorKind,
    path::{Path, PathBuf},
    sync::Arc,
    time::{Duration, SystemTime},
};

use super::{
    Shard,
    record::{FileState, PairRecord, history},
};
use bp_io::{Files, MapFormat, create_folder, resolved};

use super::{Also, BatchOptions};
use crate::{Error, Making, Outputs, Watch, pairs::Pair};

/// The folder of the records, inside the output folder.
pub(super) const RECORDS: &str = "records";

/// A temporary file this old is abandoned.
const ABANDONED: Duration = Duration::from_hours(1);

/// A pair, the paths of its outputs and the path of its record.
pub(super) struct Job {
    pub(super) pair: Pair,
    pub(super) calibration: Vec<PathBuf>,
    pub(super) outputs: Outputs,
    /// The paths of the outputs, in the order in which their states are recorded.
    pub(super) paths: Vec<PathBuf>,
    pub(super) record: PathBuf,
    /// The index of its chain; see [`BatchOptions::chain`].
    pub(super) chain: usize,
    /// The files of the whole batch.
    taken: Arc<Taken>,
}

/// The files that the pairs of a batch are read from and written to, as hashes: only a few bytes for each.
#[derive(Default)]
struct Taken {
    hashes: HashSet<u64>,
    hasher: RandomState,
}

impl Taken {
    fn add(&mut self, path: &Path) {
        self.hashes.insert(self.hasher.hash_one(key(path)));
    }

    fn has(&self, path: &Path) -> bool {
        let has = |path: &Path| self.hashes.contains(&self.hasher.hash_one(key(path)));
        has(path) || has(&resolved(path))
    }
}

/// The jobs of a shard. Fails if any two pairs, those of other shards included, would write the same file, or if an
/// output would overwrite an input.
pub(super) fn jobs(
    options: &BatchOptions,
    making: &Making,
    pairs: &[Pair],
    watch: &Watch<'_>,
) -> Result<Vec<Job>, Error> {
    // Checked once: an unknown extension is an error of the options, not of a pair.
    MapFormat::of(&Path::new("NAME").with_added_extension(&options.format))?;
    let jobs: Vec<Job> = pairs.iter().enumerate().map(|(index, pair)| Job::new(options, making, index, pair)).collect();
    let taken = Arc::new(check_apart(options, &jobs, watch)?);
    create_folder(&options.output)?;
    let of_shard = jobs.into_iter().filter(|job| options.shard.has(job.chain));
    Ok(of_shard.map(|job| Job { taken: Arc::clone(&taken), ..job }).collect())
}

impl Job {
    fn new(options: &BatchOptions, making: &Making, index: usize, pair: &Pair) -> Self {
        let named = |ending: &str| options.output.join(&pair.name).with_added_extension(ending);
        let also = |what: Also, ending: &str| options.also.contains(&what).then(|| named(ending));
        let outputs = Outputs {
            map: Some(named(&options.format)),
            picture: also(Also::Picture, "picture.png"),
            depth: also(Also::Depth, &format!("depth.{}", options.format)),
            points: also(Also::Points, "points.ply"),
            confidence: also(Also::Confidence, &format!("confidence.{}", options.format)),
        };
        let record = options.output.join(RECORDS).join(&pair.name).with_added_extension("json");
        let paths = outputs.paths(making);
        let calibration = making.calibration_files().into_iter().map(Path::to_owned).collect();
        let chain = index / options.chain();
        Self { pair: pair.clone(), calibration, outputs, paths, record, chain, taken: Arc::default() }
    }

    /// The two images.
    pub(super) fn images(&self) -> [&Path; 2] {
        [&self.pair.left, &self.pair.right]
    }

    /// The files that the outputs are made from: the images, then the calibration.
    pub(super) fn inputs(&self) -> Vec<&Path> {
        self.images().into_iter().chain(self.calibration.iter().map(PathBuf::as_path)).collect()
    }

    /// Creates the folders of its files; fails if one of them cannot be written.
    pub(super) fn check(&self, making: &Making) -> Result<(), Error> {
        for folder in self.files().filter_map(Path::parent) {
            making.files.check_own(folder)?;
            create_folder(folder)?;
        }
        making.files.check_writable(&self.record)?;
        self.outputs.check(making, &self.inputs())
    }

    /// Removes files that an earlier run wrote and this run did not. Beside the new map they would seem to belong to
    /// it.
    pub(super) fn remove_others(&self) -> Result<(), Error> {
        let Some(earlier) = PairRecord::known(&self.record)? else { return Ok(()) };
        let written: HashSet<PathBuf> = self.paths.iter().map(|path| key(path)).collect();
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
        let Some(earlier) = PairRecord::read(&self.record) else { return };
        if !images.is_empty() && !earlier.is_of_contents(images) {
            // If one cannot be removed, the next write to it reports why.
            let outputs = self.earlier_outputs(&earlier).flatten();
            outputs.chain([self.record.clone()]).for_each(|path| drop(remove(&path)));
        }
    }

    /// The outputs that a record lists and that are unchanged, at their current paths. All outputs of a pair are in one
    /// folder, which may have been moved. A changed file of the same name may belong to the user; a record may be forged and
    /// name an image of the batch, or a file of another pair.
    fn earlier_outputs(&self, earlier: &PairRecord) -> impl Iterator<Item = Result<PathBuf, bp_io::Error>> {
        earlier.done.outputs.iter().filter_map(|state| {
            let name = state.path.file_name().filter(|name| self.is_own(name))?;
            let here = self.paths.first()?.with_file_name(name);
            if !self.paths.contains(&here) && self.taken.has(&here) {
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
        let is_map = !map.contains('.') && MapFormat::of(&Path::new("NAME").with_added_extension(map)).is_ok();
        is_map || ["picture.png", "points.ply"].contains(&ending)
    }

    fn files(&self) -> impl Iterator<Item = &Path> {
        self.paths.iter().map(PathBuf::as_path).chain([self.record.as_path()])
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
pub(super) fn are_complete(chain: &[Job], settings_sha256: &str) -> bool {
    let mut follows = None;
    chain.iter().all(|job| {
        let Some(record) = PairRecord::read(&job.record) else { return false };
        let is_current = record.settings_sha256 == settings_sha256 && record.follows == follows;
        follows = Some(history(record.follows.as_deref(), &record.inputs));
        is_current && record.is_of(&job.images(), &job.paths)
    })
}

/// Fails if a job would overwrite an input, two jobs would write the same file, or a file of one is a folder of
/// another. Returns all files of the jobs.
fn check_apart(options: &BatchOptions, jobs: &[Job], watch: &Watch<'_>) -> Result<Taken, Error> {
    let mut inputs = HashSet::new();
    for job in jobs {
        watch.check()?;
        inputs.extend(job.inputs().into_iter().map(resolved));
    }
    let mut taken = Taken::default();
    inputs.iter().for_each(|path| taken.add(path));
    let summary = Shard::default().summary_path(&options.output);
    let mut files = vec![(key(&summary), summary.as_path(), Path::new("the summary"))];
    for job in jobs {
        watch.check()?;
        for path in job.files() {
            if inputs.contains(&resolved(path)) {
                let what = format!("{} would be overwritten, which is read", path.display());
                return Err(Error::Options(format!("{what}; choose another `output`")));
            }
            taken.add(path);
            files.push((key(path), path, &job.pair.left));
        }
    }
    // In order of their parts, a folder comes right before what is in it.
    files.sort_by(|(one, ..), (other, ..)| one.cmp(other));
    let clashing = files.array_windows().find(|[(one, ..), (other, ..)]| other.starts_with(one));
    let Some([(one, folder, owner), (other, path, other_owner)]) = clashing else { return Ok(taken) };
    let (place, advice) = (if one == other { path } else { folder }, "give them other names in a list of pairs");
    let [owner, other_owner] = [owner, other_owner].map(|path| path.display());
    let what = format!("{}: {owner} and {other_owner} would both go there; {advice}", place.display());
    Err(Error::Options(what))
}

/// The form in which paths are compared. Upper and lower case are equal, as on some file systems.
fn key(path: &Path) -> PathBuf {
    path.as_os_str().to_ascii_lowercase().into()
}

/// All folders that hold files of these jobs.
fn folders(options: &BatchOptions, jobs: &[Job]) -> BTreeSet<PathBuf> {
    let parents = jobs.iter().flat_map(Job::files).filter_map(Path::parent);
    parents.chain([options.output.as_path()]).map(Path::to_owned).collect()
}

/// Removes temporary files of a killed run of this shard, and abandoned ones of other shards.
pub(super) fn clear_leftovers(options: &BatchOptions, jobs: &[Job], files: &Files) -> Result<(), Error> {
    for folder in folders(options, jobs) {
        // A folder that is missing, or leads elsewhere, has no files of ours.
        let Some(entries) = files.check_own(&folder).ok().and_then(|()| fs::read_dir(&folder).ok()) else { continue };
        for entry in entries.flatten() {
            let name = entry.file_name();
            let is_old = || {
                let modified = entry.metadata().and_then(|metadata| metadata.modified()).ok();
                let age = modified.and_then(|modified| SystemTime::now().duration_since(modified).ok());
                age.is_some_and(|age| age > ABANDONED)
            };
            let is = |prefix: &str| name.as_encoded_bytes().starts_with(prefix.as_bytes());
            if is(files.prefix()) || (is(Files::PREFIX) && is_old()) {
                // Another shard that started at the same time may have removed it first.
                match fs::remove_file(entry.path()) {
                    Err(error) if error.kind() != ErrorKind::NotFound => {
                        return Err(bp_io::Error::writing(&entry.path(), &error).into());
                    }
                    _ => {}
                }
            }
        }
    }
    Ok(())
}
