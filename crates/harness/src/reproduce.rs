//! `bp reproduce`: runs and records the thesis's experiments.

mod energies;
pub mod plans;
mod run;
mod storage;

pub use plans::all as plans;
pub use run::run;
pub use storage::{Storage, begin};

use std::{
    ops::ControlFlow,
    path::{Path, PathBuf},
};

use bp_stereo::Watch;

use crate::{
    failure::Failure,
    machine,
    measure::Asked,
    record::{Cell, Labelling, Outcome, Record, Run},
    report,
    scenes::Source,
    threads,
};

/// Iterations of plain BP in a quick run: the fewest from which CFBP and CFCSBP derive different numbers of iterations.
/// The full k = L would take minutes on one thread.
const QUICK_LOOPS: u32 = 18;

/// Samples of a fast cell.
const SAMPLES: u32 = 5;

/// Labellings by other programs and by plain BP, with their energies in profile `mrf`, for the scenes whose labellings
/// are in a data folder.
///
/// # Errors
/// A message that names the file, if one is missing or differs from the manifest.
pub fn outside_energies(data: &Path) -> Result<Vec<Labelling>, String> {
    energies::compare(data, &mut |_| ControlFlow::Continue(())).map_err(|failure| failure.to_string())
}

/// Options of a run.
#[derive(Debug)]
pub struct ReproduceOptions {
    /// The folder of public data; without one the synthetic scenes run.
    pub data: Option<PathBuf>,
    /// Small images and few iterations.
    pub quick: bool,
    /// The devices, as [`Asked::open`] reads them.
    pub backends: Vec<String>,
    /// Number of threads, which a device must use.
    pub threads: Option<u16>,
    /// Samples per cell; five by default, or one in a quick run.
    pub samples: Option<u32>,
    /// The folder of recorded runs.
    pub results: PathBuf,
    /// Name of this machine in that folder.
    pub machine: Option<String>,
}

/// Runs the experiments, or resumes an interrupted run, and writes the report.
pub fn reproduce(options: &ReproduceOptions, watch: &Watch<'_>) -> Result<(), Failure> {
    let source = Source::new(options.data.clone(), options.quick)?;
    let devices = Asked::open_all(&options.backends, watch)?;
    threads::check(options.threads, &options.backends, Asked::opened(&devices).map(|runner| runner.info.workers))?;
    let samples = options.samples.unwrap_or(if options.quick { 1 } else { SAMPLES });
    let settings = settings(&source, &devices, options.quick, samples);
    watch.note(&format!("scenes: {}", source.set.described));
    source.check()?;
    let machine = machine::machine(options.machine.as_deref());
    let mut storage = storage::open(&options.results, machine, settings, watch)?;
    let outcome = run(&source, &devices, &mut storage, &|_| true, watch);
    if outcome.as_ref().is_err_and(Failure::is_interrupted) {
        let folder = storage.folder().display();
        watch.note(&format!("what was run is kept in {folder}; the same command goes on from there"));
    }
    let late = outcome?;
    report::write(storage.folder(), storage.record())?;
    watch.note(&format!("report: {}", storage.folder().join(report::PAGE_FILE).display()));
    if let Some(line) = report::headline(storage.record()) {
        watch.note(&line);
    }
    check_cells(storage.record(), late)
}

/// The recorded options of a run on these scenes and devices.
pub fn settings(source: &Source, devices: &[Asked], quick: bool, samples: u32) -> Run {
    Run {
        data: source.set.name.to_owned(),
        quick,
        labels: source.set.labels,
        k: if quick { QUICK_LOOPS } else { source.set.labels as u32 },
        samples,
        backends: devices.iter().map(|asked| asked.name.clone()).collect(),
        threads: Some(rayon::current_num_threads()),
    }
}

/// Fails if a cell failed, or if none could be run at all. `late` holds failures of cells that keep earlier samples.
pub fn check_cells(record: &Record, late: Vec<String>) -> Result<(), Failure> {
    let such_as = |Cell { scene, plan, backend, .. }: &Cell| format!("{scene}, {plan} on {backend}");
    let failed = record.cells.iter().filter_map(|cell| match &cell.outcome {
        Outcome::Error(error) => Some(format!("{}: {error}", such_as(cell))),
        _ => None,
    });
    let mut failed = failed.chain(late);
    if let Some(first) = failed.next() {
        let count = 1 + failed.count();
        return Err(Failure::other(format!("{count} cells could not be run in full, such as {first}")));
    }
    let mut unavailable = record.cells.iter().filter_map(|cell| match &cell.outcome {
        Outcome::Unavailable(reason) => Some(format!("{}: {reason}", such_as(cell))),
        _ => None,
    });
    match unavailable.next() {
        Some(first) if record.cells.iter().all(|cell| cell.measured().is_none()) => {
            Err(Failure::unavailable(format!("no cell could be run; {first}")))
        }
        _ => Ok(()),
    }
}
