//! What is expected: files that are committed, one for this kind of machine and one for all machines.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};

use crate::{
    failure::Failure,
    files::{create_folder, write_text},
    record::Machine,
};

/// Version of the files; changes with every change of meaning.
const SCHEMA_VERSION: u32 = 1;

/// Name of the file for all machines.
const ANYWHERE: &str = "anywhere";

/// A file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Baseline {
    schema_version: u32,
    /// Commit of the program that was measured for it last.
    commit: String,
    /// The processor and the number of its cores; empty and 0 in the file for all machines.
    cpu: String,
    cores: usize,
    /// The device of each runner, with its driver.
    pub(super) devices: BTreeMap<String, String>,
    /// Of runs with and without --quick, where there were any.
    pub(super) runs: BTreeMap<String, Expected>,
}

/// What a run is expected to give.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Expected {
    /// Median of each speed-up.
    pub(super) speed_ups: BTreeMap<String, f64>,
    /// What does not vary.
    pub(super) facts: BTreeMap<String, String>,
}

/// Both files.
#[derive(Clone, Debug)]
pub(super) struct Baselines {
    folder: PathBuf,
    machine_name: String,
    /// For this kind of machine, where there is one.
    pub(super) here: Option<Baseline>,
    pub(super) anywhere: Option<Baseline>,
}

impl Baselines {
    /// Reads the files of a folder that are for this machine.
    pub(super) fn read(folder: &Path, machine: &Machine) -> Result<Self, Failure> {
        if !folder.is_dir() {
            let what =
                "there is no such folder of baselines; run this in the project's folder, or name it by --baselines";
            return Err(Failure::reading(folder, &what));
        }
        let here = read(&file(folder, &machine.name))?;
        Ok(Self {
            here: here.filter(|here| (here.cpu.as_str(), here.cores) == (machine.cpu.as_str(), machine.cores)),
            anywhere: read(&file(folder, ANYWHERE))?,
            folder: folder.to_owned(),
            machine_name: machine.name.clone(),
        })
    }

    /// The file for this kind of machine.
    pub(super) fn path_here(&self) -> PathBuf {
        file(&self.folder, &self.machine_name)
    }

    /// The file for all machines.
    pub(super) fn path_anywhere(&self) -> PathBuf {
        file(&self.folder, ANYWHERE)
    }

    /// Writes both files.
    pub(super) fn write(&self) -> Result<(), Failure> {
        create_folder(&self.folder)?;
        for (path, baseline) in [(self.path_here(), &self.here), (self.path_anywhere(), &self.anywhere)] {
            let Some(baseline) = baseline else { continue };
            let json = serde_json::to_string_pretty(baseline).map_err(|error| Failure::writing(&path, &error))?;
            write_text(&path, &(json + "\n"))?;
        }
        Ok(())
    }
}

impl Baseline {
    /// One of these devices of a machine, or of all machines, that expects nothing yet.
    pub(super) fn new(machine: Option<&Machine>, devices: BTreeMap<String, String>) -> Self {
        Self {
            schema_version: SCHEMA_VERSION,
            commit: String::new(),
            cpu: machine.map_or_else(String::new, |machine| machine.cpu.clone()),
            cores: machine.map_or(0, |machine| machine.cores),
            devices,
            runs: BTreeMap::new(),
        }
    }

    /// Expects this of runs of a setting from now on.
    pub(super) fn renew(&mut self, setting: &str, expected: Expected) {
        env!("BP_COMMIT").clone_into(&mut self.commit);
        self.runs.insert(setting.to_owned(), expected);
    }
}

fn file(folder: &Path, name: &str) -> PathBuf {
    folder.join(format!("{name}.json"))
}

/// Reads a file, where it is there.
fn read(path: &Path) -> Result<Option<Baseline>, Failure> {
    let text = match fs::read_to_string(path) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        text => text.map_err(|error| Failure::reading(path, &error))?,
    };
    let baseline: Baseline = serde_json::from_str(&text).map_err(|error| Failure::reading(path, &error))?;
    if baseline.schema_version != SCHEMA_VERSION {
        let what = format!("version {} of baselines, this program has {SCHEMA_VERSION}", baseline.schema_version);
        return Err(Failure::reading(path, &format!("{what}; make it anew by --update")));
    }
    Ok(Some(baseline))
}
