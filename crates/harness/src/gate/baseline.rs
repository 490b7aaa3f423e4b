//! Baselines: committed files, one for each kind of machine and one for all machines.

use std::{
    collections::BTreeMap,
    fs,
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
    /// Rate at which the caches copied, see [`super::conditions`]. Empty in the file for all machines.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) copy_gb_per_s: Option<f64>,
    /// Median of each speed-up; none in the file for all machines.
    pub(super) speed_ups: BTreeMap<String, f64>,
    /// Results that do not vary.
    pub(super) facts: BTreeMap<String, String>,
}

/// The files of a folder.
#[derive(Clone, Debug)]
pub(super) struct Baselines {
    path_here: PathBuf,
    path_anywhere: PathBuf,
    /// For this kind of machine, if the file exists.
    pub(super) here: Option<Baseline>,
    pub(super) anywhere: Option<Baseline>,
    /// For other kinds of machines.
    pub(super) elsewhere: Vec<Baseline>,
}

/// The file for all machines.
const ANYWHERE: &str = "anywhere.json";

impl Baselines {
    /// Reads the folder's files for this machine. The folder must exist unless the baselines are to be renewed.
    pub(super) fn read(folder: &Path, machine: &Machine, renews: bool) -> Result<Self, Failure> {
        if !renews && !folder.is_dir() {
            let what =
                "there is no such folder of baselines; run this in the project's folder, or name it by --baselines";
            return Err(Failure::reading(folder, &what));
        }
        let path_here = folder.join(format!("{}.json", machine::kind(machine)));
        let path_anywhere = folder.join(ANYWHERE);
        let elsewhere = elsewhere(folder, &path_here)?;
        let (here, anywhere) = (file::read(&path_here)?, file::read(&path_anywhere)?);
        Ok(Self { here, anywhere, elsewhere, path_here, path_anywhere })
    }

    /// The file for this kind of machine.
    pub(super) fn path_here(&self) -> &Path {
        &self.path_here
    }

    /// The same, to be written to another folder.
    pub(super) fn moved_to(&self, folder: &Path) -> Self {
        let moved = |path: &Path| folder.join(path.file_name().unwrap_or_default());
        Self { path_here: moved(&self.path_here), path_anywhere: moved(&self.path_anywhere), ..self.clone() }
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

/// The baselines of other kinds of machines than the one with this file.
fn elsewhere(folder: &Path, here: &Path) -> Result<Vec<Baseline>, Failure> {
    let Ok(files) = fs::read_dir(folder) else { return Ok(Vec::new()) };
    let is_other = |path: &PathBuf| {
        let others = [ANYWHERE, file::INSTRUCTIONS].map(|name| folder.join(name));
        path.extension().is_some_and(|extension| extension == "json") && path != here && !others.contains(path)
    };
    let mut paths: Vec<_> = files.flatten().map(|file| file.path()).filter(is_other).collect();
    paths.sort();
    paths.iter().filter_map(|path| file::read(path).transpose()).collect()
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
