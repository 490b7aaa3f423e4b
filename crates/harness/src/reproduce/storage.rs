//! The folder of a run: created once, resumed after an interruption, never overwritten.

use std::{
    fs::{self, File, TryLockError},
    path::{Path, PathBuf},
};

use jiff::{Timestamp, Zoned};

use bp_stereo::Watch;

use crate::{
    failure::Failure,
    files::{below, create_folder},
    machine,
    record::{MAPS_FOLDER, Machine, Program, RECORD_FILE, Record, Run, SCHEMA_VERSION, load},
    report::PAGE_FILE,
};

/// Name of the file that is locked while a run is active.
const LOCK_FILE: &str = ".lock";

/// A run being recorded.
pub struct Storage {
    folder: PathBuf,
    record: Record,
    /// Held while the run is active; the system releases it however the program ends.
    _lock: File,
}

/// Resumes an interrupted run of the same program, machine and settings, or begins a new one. Skips runs that another
/// process is working on.
pub(super) fn open(results: &Path, machine: Machine, run: Run, watch: &Watch<'_>) -> Result<Storage, Failure> {
    let program = machine::program()?;
    let interrupted = |folder: &Path| {
        let same = |record: &Record| record.program == program && record.machine == machine && record.run == run;
        load(folder).ok().filter(|record| same(record) && is_unfinished(folder, record))
    };
    for folder in runs(results).into_iter().filter(|folder| interrupted(folder).is_some()) {
        let Some(lock) = lock(&folder)? else { continue };
        // Checked again under the lock: until then, another process may have been working on it.
        let Some(record) = interrupted(&folder) else { continue };
        watch.note(&format!("going on with the interrupted run in {}", folder.display()));
        return Ok(Storage { folder, record, _lock: lock });
    }
    begin(results, program, machine, run)
}

/// Whether cells or the report are missing. The report's page is written last.
fn is_unfinished(folder: &Path, record: &Record) -> bool {
    !record.complete || !folder.join(PAGE_FILE).exists()
}

/// Begins a run.
pub fn begin(results: &Path, program: Program, machine: Machine, run: Run) -> Result<Storage, Failure> {
    let folder = new_folder(results, &machine, &run)?;
    let lock = lock(&folder)?.ok_or_else(|| Failure::writing(&folder, &"another process took it"))?;
    let now = Timestamp::now().to_string();
    let record = Record {
        schema_version: SCHEMA_VERSION,
        complete: false,
        started: now.clone(),
        updated: now,
        program,
        machine,
        run,
        scenes: Vec::new(),
        cells: Vec::new(),
        labellings: Vec::new(),
    };
    let mut storage = Storage { folder, record, _lock: lock };
    storage.save()?;
    Ok(storage)
}

/// The lock of a run's folder; `None` if another process holds it.
fn lock(folder: &Path) -> Result<Option<File>, Failure> {
    let path = folder.join(LOCK_FILE);
    below(folder).check_own(&path)?;
    let file = File::options().create(true).truncate(false).write(true).open(&path);
    let file = file.map_err(|error| Failure::writing(&path, &error))?;
    match file.try_lock() {
        Ok(()) => Ok(Some(file)),
        Err(TryLockError::WouldBlock) => Ok(None),
        Err(TryLockError::Error(error)) => Err(Failure::writing(&path, &error)),
    }
}

/// Folders of recorded runs, sorted by name.
fn runs(results: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(results).into_iter().flatten().flatten();
    let mut folders: Vec<_> =
        entries.map(|entry| entry.path()).filter(|path| path.join(RECORD_FILE).exists()).collect();
    folders.sort();
    folders
}

/// Creates a folder named after date, machine and data, with a number from the second such run of a day on.
fn new_folder(results: &Path, machine: &Machine, run: &Run) -> Result<PathBuf, Failure> {
    let name = format!("{}-{}-{}", Zoned::now().date(), machine.name, run.data);
    let numbered = (2..).map(|number| format!("{name}-{number}"));
    create_folder(results)?;
    for name in std::iter::once(name.clone()).chain(numbered) {
        let folder = results.join(name);
        match fs::create_dir(&folder) {
            Ok(()) => {
                create_folder(&folder.join(MAPS_FOLDER))?;
                return Ok(folder);
            }
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(Failure::writing(&folder, &error)),
        }
    }
    Err(Failure::other(format!("{}: no name is left for another run", results.display())))
}

impl Storage {
    /// The run's folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The record so far.
    pub fn record(&self) -> &Record {
        &self.record
    }

    /// The record, to be changed and then saved.
    pub fn record_mut(&mut self) -> &mut Record {
        &mut self.record
    }

    /// Writes the record.
    pub fn save(&mut self) -> Result<(), Failure> {
        self.record.updated = Timestamp::now().to_string();
        let path = self.folder.join(RECORD_FILE);
        Ok(below(&self.folder).json(&path, &self.record)?)
    }
}
