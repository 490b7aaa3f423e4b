//! Baselines: committed files, one for each kind of machine and one for all machines.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};

use super::{file, subject::Renewal};
use crate::{failure::Failure, machine, record::Machine};

/// A baseline file. Programs identify its machine by the file's name, people by its fields.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Baseline {
    /// The CPU and its number of cores; empty and 0 in the file for all machines.
    cpu: String,
    cores: usize,
    /// Expected results of runs with and without --quick, if any were measured.
    pub(super) runs: BTreeMap<String, Expected>,
}

/// Expected results of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Expected {
    /// Commit of the measured program.
    pub(super) commit: String,
    /// The device of each runner, with its driver.
    pub(super) devices: BTreeMap<String, String>,
    /// Median of each speed-up.
    pub(super) speed_ups: BTreeMap<String, f64>,
    /// Results that do not vary.
    pub(super) facts: BTreeMap<String, String>,
}

/// Both files.
#[derive(Clone, Debug)]
pub(super) struct Baselines {
    path_here: PathBuf,
    path_anywhere: PathBuf,
    /// For this kind of machine, if the file exists.
    pub(super) here: Option<Baseline>,
    pub(super) anywhere: Option<Baseline>,
}

impl Baselines {
    /// Reads the folder's files for this machine. The folder must exist unless the baselines are to be renewed.
    pub(super) fn read(folder: &Path, machine: &Machine, renews: bool) -> Result<Self, Failure> {
        if !renews && !folder.is_dir() {
            let what =
                "there is no such folder of baselines; run this in the project's folder, or name it by --baselines";
            return Err(Failure::reading(folder, &what));
        }
        let path_here = folder.join(format!("{}.json", machine::kind(machine)));
        let path_anywhere = folder.join("anywhere.json");
        Ok(Self { here: file::read(&path_here)?, anywhere: file::read(&path_anywhere)?, path_here, path_anywhere })
    }

    /// The file for this kind of machine.
    pub(super) fn path_here(&self) -> &Path {
        &self.path_here
    }

    /// The file for all machines.
    #[cfg(test)]
    pub(super) fn path_anywhere(&self) -> &Path {
        &self.path_anywhere
    }

    /// Writes the renewed baselines; returns the names of the files.
    pub(super) fn write(&self, renewal: Renewal) -> Result<Vec<String>, Failure> {
        let here = [(&self.path_here, &self.here)];
        let all = [(&self.path_here, &self.here), (&self.path_anywhere, &self.anywhere)];
        let renewed = if renewal == Renewal::Here { &here[..] } else { &all[..] };
        for (path, baseline) in renewed {
            file::write(path, baseline)?;
        }
        Ok(renewed.iter().map(|(path, _)| path.display().to_string()).collect())
    }
}

impl Baseline {
    /// An empty baseline for a machine, or for all machines.
    pub(super) fn new(machine: Option<&Machine>) -> Self {
        Self {
            cpu: machine.map_or_else(String::new, machine::processor),
            cores: machine.map_or(0, |machine| machine.cores),
            runs: BTreeMap::new(),
        }
    }
}
