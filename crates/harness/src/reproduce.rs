//! `bp reproduce`: the thesis's experiments, run and recorded.

mod energies;
pub(crate) mod plans;
mod run;
mod storage;

pub(crate) use plans::all as plans;
pub use run::ONE_SAMPLE_ABOVE_MS;
pub(crate) use run::run;
pub(crate) use storage::{Storage, begin};

use std::{ops::ControlFlow, path::Path};

use crate::{
    args::ReproduceArgs,
    backends::{self, Asked},
    failure::Failure,
    interrupt, machine, note,
    record::{Cell, Labelling, Outcome, Record, Run},
    report,
    scenes::Source,
    threads,
};

/// Loops of plain BP in a quick run: the fewest of which CFBP and CFCSBP make different numbers of loops. A whole k = L
/// would take minutes on one thread.
const QUICK_LOOPS: u32 = 18;

/// Samples of a cell that takes little time.
const SAMPLES: u32 = 5;

/// Labellings by other programs and by plain BP, with their energies in profile `mrf`, of the scenes whose labellings a
/// data folder holds.
///
/// # Errors
/// A message that names the file, where one is missing or not as listed.
pub fn outside_energies(data: &Path) -> Result<Vec<Labelling>, String> {
    energies::compare(data, &mut |_| ControlFlow::Continue(())).map_err(|failure| failure.to_string())
}

/// Runs the command.
pub(crate) fn reproduce(args: &ReproduceArgs) -> Result<(), Failure> {
    interrupt::listen()?;
    threads::run_on(args.threads, || run_all(args))
}

/// Runs what is asked for and writes its report.
fn run_all(args: &ReproduceArgs) -> Result<(), Failure> {
    let source = Source::new(&args.data, args.quick)?;
    let mut devices = backends::open_all(&args.backend)?;
    let opened: Vec<_> = devices.iter().filter_map(|asked| asked.device.as_ref().ok()).collect();
    threads::check(args.threads, &opened)?;
    let samples = args.samples.unwrap_or(if args.quick { 1 } else { SAMPLES });
    let settings = settings(&source, &devices, args.quick, samples);
    note(&format!("scenes: {}", source.set.described));
    source.check()?;
    let machine = machine::machine(args.machine.as_deref());
    let mut storage = storage::open(&args.results, machine, settings)?;
    let outcome = run(&source, &mut devices, &mut storage, &|_| true);
    if outcome.as_ref().is_err_and(Failure::is_interrupted) {
        note(&format!("what was run is kept in {}; the same command goes on from there", storage.folder().display()));
    }
    let late = outcome?;
    report::write(storage.folder(), storage.record())?;
    note(&format!("report: {}", storage.folder().join(report::PAGE_FILE).display()));
    check_cells(storage.record(), late)
}

/// What a run on these scenes and devices asks for.
pub(crate) fn settings(source: &Source, devices: &[Asked], quick: bool, samples: u32) -> Run {
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

/// Fails where a cell failed, be it `late`, after samples that are kept, or where none could be run at all.
pub(crate) fn check_cells(record: &Record, late: Vec<String>) -> Result<(), Failure> {
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
