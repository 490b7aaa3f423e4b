//! What is expected: files that are committed, one for this kind of machine and one for all machines.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};

use super::file;
use crate::{failure::Failure, machine::processor, record::Machine};

/// Name of the file for all machines.
const ANYWHERE: &str = "anywhere";

/// A file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Baseline {
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
        let here: Option<Baseline> = file::read(&named(folder, &machine.name))?;
        Ok(Self {
            here: here.filter(|here| (&here.cpu, here.cores) == (&processor(machine), machine.cores)),
            anywhere: file::read(&named(folder, ANYWHERE))?,
            folder: folder.to_owned(),
            machine_name: machine.name.clone(),
        })
    }

    /// The file for this kind of machine.
    pub(super) fn path_here(&self) -> PathBuf {
        named(&self.folder, &self.machine_name)
    }

    /// The file for all machines.
    pub(super) fn path_anywhere(&self) -> PathBuf {
        named(&self.folder, ANYWHERE)
    }

    /// Writes both files.
    pub(super) fn write(&self) -> Result<(), Failure> {
        for (path, baseline) in [(self.path_here(), &self.here), (self.path_anywhere(), &self.anywhere)] {
            baseline.as_ref().map_or(Ok(()), |baseline| file::write(&path, baseline))?;
        }
        Ok(())
    }
}

impl Baseline {
    /// One of these devices of a machine, or of all machines, that expects nothing yet.
    pub(super) fn new(machine: Option<&Machine>, devices: BTreeMap<String, String>) -> Self {
        Self {
            commit: String::new(),
            cpu: machine.map_or_else(String::new, processor),
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

fn named(folder: &Path, name: &str) -> PathBuf {
    folder.join(format!("{name}.json"))
}
