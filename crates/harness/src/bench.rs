//! The measurements of `cargo bench`: the cells of the thesis's tables and some kernels, measured by the code of `bp
//! reproduce` and `bp speed`. Criterion itself would measure one contestant after another, and the machine would drift
//! between them. Here the contestants take turns first, and then criterion receives the samples.

mod list;
mod settings;

use std::{collections::HashSet, ffi::OsString, path::Path};

pub use list::Bench;
use list::Of;
use settings::Settings;

use bp_stereo::Watch;

use crate::{
    failure::Failure,
    machine,
    measure::Asked,
    record::speed::Speed,
    report, reproduce,
    scenes::Source,
    speed::{self, Files, SpeedOptions},
    threads,
};

/// Reads an environment variable by its name.
pub type Environment<'a> = dyn Fn(&str) -> Option<OsString> + Sync + 'a;

/// All possible benches, without samples. Only a measurement shows whether a device has a clock.
///
/// # Errors
/// A message that names the invalid environment variable.
pub fn possible(environment: &Environment<'_>, watch: &Watch<'_>) -> Result<Vec<Bench>, String> {
    let job = Settings::read(environment).and_then(|settings| Job::new(settings, watch));
    Ok(job.map_err(|failure| failure.to_string())?.possible)
}

/// Measures the scenes and problems of all benches whose names satisfy `is_asked`. Writes records, tables and charts to
/// a new folder in `results`, and passes all benches to `show`.
///
/// # Errors
/// A message that says what could not be measured or written.
pub fn run(
    is_asked: &(dyn Fn(&str) -> bool + Sync),
    results: &Path,
    environment: &Environment<'_>,
    watch: &Watch<'_>,
    show: impl FnOnce(&[Bench]),
) -> Result<(), String> {
    let measure = || {
        let job = Job::new(Settings::read(environment)?, watch)?;
        let asked = job.possible.iter().filter(|bench| is_asked(&bench.id())).map(|bench| bench.of).collect();
        job.measure(&asked, results, watch)
    };
    let measured = threads::run_on(None, measure).and_then(|measured| measured.shown(watch, show));
    measured.map_err(|failure| failure.to_string())
}

/// What can be measured.
struct Job {
    settings: Settings,
    source: Source,
    backends: Vec<String>,
    possible: Vec<Bench>,
}

/// What was measured.
struct Measured {
    storage: reproduce::Storage,
    /// Whether any scene was measured.
    scenes: bool,
    late: Vec<String>,
    speed: Option<Speed>,
    benches: Vec<Bench>,
}

impl Job {
    fn new(settings: Settings, watch: &Watch<'_>) -> Result<Self, Failure> {
        let source = Source::new(settings.data.clone(), settings.quick)?;
        let backends = settings.backends(watch)?;
        let possible = list::benches(&source.names(), &backends, None);
        Ok(Self { settings, source, backends, possible })
    }

    fn measure(&self, asked: &HashSet<Of>, results: &Path, watch: &Watch<'_>) -> Result<Measured, Failure> {
        let Self { settings, source, backends, .. } = self;
        let devices = Asked::open_all(backends, watch).map_err(|failure| failure.of(settings::BACKEND))?;
        let is_asked = |name: &str| asked.iter().any(|of| matches!(of, Of::Scene(scene) if *scene == name));
        let scenes = source.names().into_iter().any(is_asked);
        if scenes {
            watch.note(&format!("scenes: {}", source.set.described));
            source.check()?;
        }
        let run = reproduce::settings(source, &devices, settings.quick, settings.rounds());
        let mut storage = reproduce::begin(results, machine::program()?, machine::machine(None), run)?;
        let mut late = Vec::new();
        if scenes {
            let ran = reproduce::run(source, &devices, &mut storage, &is_asked, watch);
            late = ran.inspect_err(|_| {
                let folder = storage.folder().display();
                watch.note(&format!(
                    "what was measured is in {folder}; `bp report {folder}` makes its tables and charts"
                ));
            })?;
            report::write(storage.folder(), storage.record())?;
        }
        let problem = |of: &Of| if let Of::Problem(name) = of { Some((*name).to_owned()) } else { None };
        let speed = kernels(settings, asked.iter().filter_map(problem).collect(), &devices, watch)?;
        if let Some(speed) = &speed {
            watch.note(&Files::new(storage.folder())?.write(speed)?);
        }
        let benches = list::benches(&source.names(), backends, Some((storage.record(), speed.as_ref())));
        Ok(Measured { storage, scenes, late, speed, benches })
    }
}

/// Measures the problems, if any.
fn kernels(
    settings: &Settings,
    problems: Vec<String>,
    devices: &[Asked],
    watch: &Watch<'_>,
) -> Result<Option<Speed>, Failure> {
    let options = SpeedOptions { rounds: Some(settings.rounds()), quick: settings.quick, problems, output: None };
    let asked = (!options.problems.is_empty()).then(|| speed::measure(&options, devices, watch));
    asked.transpose()
}

impl Measured {
    /// Shows the benches and reports where the tables and charts are; fails if something could not be measured.
    fn shown(self, watch: &Watch<'_>, show: impl FnOnce(&[Bench])) -> Result<(), Failure> {
        show(&self.benches);
        if self.scenes {
            watch.note(&format!("tables and charts: {}", self.storage.folder().join(report::PAGE_FILE).display()));
            reproduce::check_cells(self.storage.record(), self.late)?;
        }
        self.speed.as_ref().map_or(Ok(()), speed::check)
    }
}
