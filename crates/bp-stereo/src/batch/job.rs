//! What is to be done for each pair, and whether it can be.

use std::{
    collections::{BTreeSet, HashMap, HashSet},
    ffi::OsString,
    fs,
    io::ErrorKind,
    path::{Display, Path, PathBuf},
    time::{Duration, SystemTime},
};

use super::{
    Shard,
    record::{FileState, PairRecord, history},
};
use bp_io::{Files, MapFormat, create_folder, resolved};

use super::{Also, BatchOptions};
use crate::{Error, Making, Outputs, pairs::Pair};

/// The folder of the records, in that of the outputs.
pub(super) const RECORDS: &str = "records";

/// After how long nobody can be writing to a temporary file any more.
const ABANDONED: Duration = Duration::from_hours(1);

/// A pair, where its outputs go and where its record is.
pub(super) struct Job {
    pub(super) pair: Pair,
    pub(super) calibration: Option<PathBuf>,
    pub(super) outputs: Outputs,
    /// Of the outputs, in the order in which their states are recorded.
    pub(super) paths: Vec<PathBuf>,
    pub(super) record: PathBuf,
    /// Which of the pairs that are done together it belongs to.
    pub(super) chain: usize,
}

/// The jobs of a shard. Fails where outputs of any pairs, of other shards too, would be the same file or overwrite
/// what is read.
pub(super) fn jobs(options: &BatchOptions, making: &Making, pairs: &[Pair]) -> Result<Vec<Job>, Error> {
    // An ending that stands for no format is the fault of none of the pairs.
    MapFormat::of(&Path::new("NAME").with_added_extension(&options.format))?;
    let jobs: Vec<Job> = pairs.iter().enumerate().map(|(index, pair)| Job::new(options, making, index, pair)).collect();
    check_apart(options, &jobs)?;
    let jobs: Vec<Job> = jobs.into_iter().filter(|job| options.shard.has(job.chain)).collect();
    folders(options, &jobs).iter().try_for_each(|folder| create_folder(folder))?;
    Ok(jobs)
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
        let calibration = making.geometry.as_ref().and_then(|geometry| Some(geometry.file.as_ref()?.path.clone()));
        let chain = index / options.chain();
        Self { pair: pair.clone(), calibration, outputs, paths, record, chain }
    }

    /// The two images.
    pub(super) fn images(&self) -> [&Path; 2] {
        [&self.pair.left, &self.pair.right]
    }

    /// Both images, as messages name them.
    pub(super) fn images_name(&self) -> String {
        format!("{} and {}", self.pair.left.display(), self.pair.right.display())
    }

    /// The files that the outputs are made of, the images first.
    pub(super) fn inputs(&self) -> Vec<&Path> {
        self.images().into_iter().chain(self.calibration.as_deref()).collect()
    }

    /// Fails where an output cannot be written.
    pub(super) fn check(&self, making: &Making) -> Result<(), Error> {
        self.outputs.check(making, &self.inputs())
    }

    /// Removes files that an earlier run wrote and this one did not: beside the new map they would be taken for its own.
    pub(super) fn remove_others(&self) {
        let Some(earlier) = PairRecord::read(&self.record) else { return };
        let written: HashSet<OsString> = self.paths.iter().map(|path| key(path)).collect();
        self.earlier_outputs(&earlier).filter(|path| !written.contains(&key(path))).for_each(remove);
    }

    /// Removes what an earlier command has made of other images than these, which failed now: it would be taken for
    /// theirs.
    pub(super) fn remove_stale(&self, images: &[FileState]) {
        let Some(earlier) = PairRecord::read(&self.record) else { return };
        if !images.is_empty() && !earlier.is_of_contents(images) {
            self.earlier_outputs(&earlier).chain([self.record.clone()]).for_each(remove);
        }
    }

    /// The outputs that a record tells of, where they are now, as they were: all of a pair are in one folder, which may
    /// have been moved, and one of such a name may be another pair's by now, or the user's.
    fn earlier_outputs(&self, earlier: &PairRecord) -> impl Iterator<Item = PathBuf> {
        earlier.done.outputs.iter().filter_map(|state| {
            let here = self.paths.first()?.with_file_name(state.path.file_name()?);
            state.is_still(&here).then_some(here)
        })
    }

    fn files(&self) -> impl Iterator<Item = &Path> {
        self.paths.iter().map(PathBuf::as_path).chain([self.record.as_path()])
    }
}

/// A file that is not there is as good as removed, and one that cannot be is told where it is written next.
fn remove(path: PathBuf) {
    drop(fs::remove_file(path));
}

/// Whether nothing is to be done of pairs that are done together, in their order.
pub(super) fn are_complete(chain: &[Job], settings_sha256: &str) -> bool {
    let mut follows = None;
    chain.iter().all(|job| {
        let Some(record) = PairRecord::read(&job.record) else { return false };
        let is_current = record.settings_sha256 == settings_sha256 && record.follows == follows;
        follows = Some(history(record.follows.as_deref(), &record.inputs));
        is_current && record.is_of(&job.images(), &job.paths)
    })
}

/// Fails where a job would write what is read, two would write the same file, or one's file is another's folder.
fn check_apart(options: &BatchOptions, jobs: &[Job]) -> Result<(), Error> {
    let inputs: HashSet<PathBuf> = jobs.iter().flat_map(Job::inputs).map(resolved).collect();
    let files = || jobs.iter().flat_map(|job| job.files().map(move |path| (job.pair.left.display(), path)));
    if let Some((_, path)) = files().find(|(_, path)| inputs.contains(&resolved(path))) {
        let what = format!("{} would be overwritten, which is read", path.display());
        return Err(Error::Options(format!("{what}; choose another `output`")));
    }
    let summary = Shard::default().summary_path(&options.output);
    let mut owners = HashMap::from([(key(&summary), "the summary".to_owned())]);
    for (owner, path) in files() {
        if let Some(other) = owners.insert(key(path), owner.to_string()) {
            return Err(clash(path, &other, &owner.to_string()));
        }
    }
    let taken = |(owner, path): (Display<'_>, &Path)| {
        let folder = path.ancestors().skip(1).find(|folder| owners.contains_key(&key(folder)))?;
        Some(clash(folder, &owners[&key(folder)], &owner.to_string()))
    };
    files().find_map(taken).map_or(Ok(()), Err)
}

/// What tells paths apart: letters count as equal in both cases, as they do on some file systems.
fn key(path: &Path) -> OsString {
    path.as_os_str().to_ascii_lowercase()
}

fn clash(path: &Path, one: &str, other: &str) -> Error {
    let advice = "give them other names in a list of pairs";
    Error::Options(format!("{}: {one} and {other} would both go there; {advice}", path.display()))
}

/// All folders that files of these jobs are in.
fn folders(options: &BatchOptions, jobs: &[Job]) -> BTreeSet<PathBuf> {
    let parents = jobs.iter().flat_map(Job::files).filter_map(Path::parent);
    parents.chain([options.output.as_path()]).map(Path::to_owned).collect()
}

/// Removes temporary files of an earlier run of this shard that was killed, and of others that nobody writes any more.
pub(super) fn clear_leftovers(options: &BatchOptions, jobs: &[Job], files: &Files) -> Result<(), Error> {
    for folder in folders(options, jobs) {
        let entries = fs::read_dir(&folder).map_err(|error| bp_io::Error::writing(&folder, &error))?;
        for entry in entries.flatten() {
            let name = entry.file_name();
            let is_old = || {
                let modified = entry.metadata().and_then(|metadata| metadata.modified()).ok();
                let age = modified.and_then(|modified| SystemTime::now().duration_since(modified).ok());
                age.is_some_and(|age| age > ABANDONED)
            };
            let is = |prefix: &str| name.as_encoded_bytes().starts_with(prefix.as_bytes());
            if is(files.prefix()) || (is(Files::PREFIX) && is_old()) {
                // Another shard, started together with this one, may have been faster.
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
