//! The settings of `cargo bench`, and its first bench: the cells of the thesis's tables, measured in turns by the code of `bp
//! reproduce`. The second, `benches/matches.rs`, is criterion's own.
//!
//! Settings are environment variables, because the command line of a bench belongs to criterion.

use std::{
    ffi::OsString,
    path::{Path, PathBuf},
};

use bp_core::{Backend, DeviceKind};
use bp_stereo::Watch;

use crate::{backends, failure::Failure, machine, measure::Asked, report, reproduce, scenes::Source, threads};

/// The size of the run: "quick" or "full".
const SIZE: &str = "BP_BENCH";

/// The backends, separated by commas.
const BACKEND: &str = "BP_BENCH_BACKEND";

/// The folder of public data, as for `bp`.
const DATA: &str = "BP_DATA";

/// Rounds of a quick run, as in that of `bp reproduce`.
const QUICK_ROUNDS: u32 = 1;

/// Rounds of a full run.
const ROUNDS: u32 = 20;

/// The settings of a run.
#[derive(Debug, PartialEq, Eq)]
pub struct Settings {
    /// Small images and few iterations, on every backend.
    pub quick: bool,
    /// The backends, if named.
    named: Option<Vec<String>>,
    /// The folder of public data, relative to the workspace, because cargo runs benches in their package's folder.
    data: Option<PathBuf>,
}

impl Settings {
    /// Reads the settings. An empty variable counts as unset.
    ///
    /// # Errors
    /// A message that names the invalid variable.
    pub fn read(variable: impl Fn(&str) -> Option<OsString>) -> Result<Self, Failure> {
        let value = |name| variable(name).filter(|value| !value.is_empty());
        let text = |name| value(name).map(|value| value.to_string_lossy().into_owned());
        let quick = match text(SIZE).as_deref() {
            None | Some("full") => false,
            Some("quick") => true,
            Some(other) => return Err(Failure::usage(format!("{SIZE}={other}: it is quick or full"))),
        };
        let named = text(BACKEND).map(|names| names.split(',').map(str::to_owned).collect());
        let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        Ok(Self { quick, named, data: value(DATA).map(|folder| workspace.join(folder)) })
    }

    /// The scenes.
    ///
    /// # Errors
    /// If the folder of public data lacks them.
    pub fn source(&self) -> Result<Source, Failure> {
        Source::new(self.data.clone(), self.quick)
    }

    /// Opens the devices.
    ///
    /// # Errors
    /// If a name is wrong, or none of them is available.
    pub fn open(&self, watch: &Watch<'_>) -> Result<Vec<Asked>, Failure> {
        Asked::open_all(&self.backends(watch)?, watch).map_err(|failure| failure.of(BACKEND))
    }

    /// Number of rounds. Every contestant takes one turn in each.
    fn rounds(&self) -> u32 {
        if self.quick { QUICK_ROUNDS } else { ROUNDS }
    }

    /// The backends by their names in records: those requested, otherwise all, or in a full run those that matter.
    fn backends(&self, watch: &Watch<'_>) -> Result<Vec<String>, Failure> {
        let by_default = || backends::ALL.iter().filter(|backend| self.quick || matters(**backend, watch));
        let names =
            self.named.clone().unwrap_or_else(|| by_default().map(|backend| backend.name().to_owned()).collect());
        let mut chosen: Vec<String> = Vec::new();
        for name in &names {
            let name = backends::choose(name, None).map_err(|failure| failure.of(BACKEND))?.name;
            if chosen.contains(&name) {
                return Err(Failure::usage(format!("{BACKEND} names {name} twice")));
            }
            chosen.push(name);
        }
        Ok(chosen)
    }
}

/// Measures the thesis's tables on the scenes whose names contain one of `scenes`, or on all if there are none. Writes the
/// record, tables and charts to a new folder in `results`.
///
/// # Errors
/// If something could not be measured or written, or no scene has such a name.
pub fn thesis(settings: &Settings, scenes: &[&String], results: &Path, watch: &Watch<'_>) -> Result<(), Failure> {
    threads::run_on(None, || {
        let (source, devices) = (settings.source()?, settings.open(watch)?);
        let is_asked = |name: &str| scenes.is_empty() || scenes.iter().any(|part| name.contains(part.as_str()));
        if !source.names().into_iter().any(is_asked) {
            return Err(Failure::usage(format!("no scene is called so; there are {}", source.names().join(", "))));
        }
        watch.note(&format!("scenes: {}", source.set.described));
        source.check()?;
        let run = reproduce::settings(&source, &devices, settings.quick, settings.rounds());
        let mut storage = reproduce::begin(results, machine::program()?, machine::machine(None), run)?;
        let late = reproduce::run(&source, &devices, &mut storage, &is_asked, watch).inspect_err(|_| {
            let folder = storage.folder().display();
            watch.note(&format!("what was measured is in {folder}; `bp report {folder}` makes its tables and charts"));
        })?;
        report::write(storage.folder(), storage.record())?;
        watch.note(&format!("tables and charts: {}", storage.folder().join(report::PAGE_FILE).display()));
        reproduce::check_cells(storage.record(), late)
    })
}

/// Whether a full run includes the backend by default. The reference and software rasterisers would turn minutes into
/// an hour, and a quick run says as much about the algorithms on them.
fn matters(backend: &dyn Backend, watch: &Watch<'_>) -> bool {
    let name = backend.name();
    let software = backend.devices().into_iter().next().filter(|info| info.kind == DeviceKind::SoftwareRasteriser);
    let why = match software {
        Some(info) => format!("{} is a software rasteriser", info.name),
        None if name == backends::ALL[0].name() => "it is the reference, and slow".to_owned(),
        None => return true,
    };
    watch.note(&format!("{name}: left out of a full run: {why}; {BACKEND}={name} asks for it"));
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(variables: &[(&str, &str)]) -> Result<Settings, Failure> {
        Settings::read(|name| Some(variables.iter().find(|(known, _)| *known == name)?.1.into()))
    }

    #[test]
    fn variables_are_followed_and_empty_ones_are_none() {
        let full = Settings { quick: false, named: None, data: None };
        assert_eq!(read(&[]).unwrap(), full);
        assert_eq!(read(&[(SIZE, ""), (BACKEND, ""), (DATA, "")]).unwrap(), full);
        assert_eq!(read(&[(SIZE, "full")]).unwrap(), full);
        let quick = read(&[(SIZE, "quick"), (BACKEND, "rayon,scalar"), (DATA, "/data")]).unwrap();
        assert_eq!(quick.data, Some(PathBuf::from("/data")));
        assert_eq!(quick.backends(&Watch::default()).unwrap(), ["rayon", "scalar"]);
        assert!(quick.rounds() < full.rounds());
    }

    #[test]
    fn a_folder_of_data_is_taken_from_the_workspace_s() {
        let data = read(&[(DATA, "crates/harness/src")]).unwrap().data.unwrap();
        assert!(data.join("bench.rs").exists(), "{}", data.display());
    }

    #[test]
    fn every_backend_is_in_a_quick_run_and_the_slow_reference_not_in_a_full_one() {
        let backends = |size| read(&[(SIZE, size)]).unwrap().backends(&Watch::default()).unwrap();
        let [quick, full] = ["quick", "full"].map(backends);
        assert_eq!(quick.len(), backends::ALL.len());
        assert!(full.contains(&"rayon".to_owned()) && !full.contains(&"scalar".to_owned()), "{full:?}");
    }

    #[test]
    fn what_a_variable_must_not_say_is_refused_by_its_name() {
        let told = |variables: &[(&str, &str)]| {
            read(variables).and_then(|settings| settings.backends(&Watch::default())).unwrap_err().to_string()
        };
        let size = told(&[(SIZE, "fast")]);
        assert!(size.contains("BP_BENCH=fast") && size.contains("quick or full"), "{size}");
        for (names, word) in [("magic", "scalar"), ("rayon,", "scalar"), ("rayon,rayon:0", "rayon twice")] {
            let backend = told(&[(BACKEND, names)]);
            assert!(backend.contains(BACKEND) && backend.contains(word), "{backend}");
        }
    }
}
