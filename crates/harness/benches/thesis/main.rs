//! The thesis's tables by `cargo bench`: every algorithm on every scene and backend, and kernels.
//!
//! `[BP_BENCH=quick] [BP_BENCH_BACKEND=NAMES] [BP_DATA=DIR] cargo bench [-- FILTER]`
//!
//! Criterion would measure one bench after another. On a machine that is never quiet, minutes would pass between two
//! algorithms whose ratio is the result. So the code of `bp reproduce` and `bp speed` measures everything beforehand,
//! in turns, and criterion receives the samples. Its messages about warm-up, iterations and estimated times refer to
//! this transfer. A scene is measured if criterion's filter leaves one of its benches. Criterion shows means with their
//! intervals, and the changes since the last run. Our tables and charts show medians. They are made from our own
//! records and written to a new folder in `bench-results` of the target folder.
//!
//! Groups are named after the tables that show their times. Totals go from images to labels by the wall clock and
//! include the wait for the device. A device with a clock of its own has a second bench by that clock.
//!
//! `BP_BENCH` is `full`, the default, or `quick`: small images and few iterations, on every backend. A full run leaves
//! out the reference and software rasterisers unless `BP_BENCH_BACKEND` names them.

mod replay;

use std::{
    collections::HashSet,
    path::Path,
    process::{Command, ExitCode},
};

use bp_stereo::{Event, Stop, Watch};
use criterion::Criterion;
use harness::bench;

fn main() -> ExitCode {
    match run(&std::env::args().skip(1).collect::<Vec<_>>()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}

/// Prints a bench's messages, in addition to criterion's.
fn tell(event: Event<'_>) {
    match event {
        Event::Line(line) | Event::Note(line) => eprintln!("{line}"),
        Event::Warning(line) => eprintln!("warning: {line}"),
        _ => {}
    }
}

fn run(arguments: &[String]) -> Result<(), String> {
    let stop = Stop::default();
    let asks = stop.clone();
    let stops = move || {
        if asks.stop() {
            std::process::exit(130);
        }
    };
    ctrlc::set_handler(stops).map_err(|error| format!("cannot handle Ctrl-C: {error}"))?;
    let watch = Watch::new(&tell, &stop);
    let environment = |name: &str| std::env::var_os(name);
    let has = |option: &str| arguments.iter().any(|argument| argument == option);
    let mut criterion = Criterion::default().without_plots().configure_from_args();
    if has("--list") {
        replay::list(&mut criterion, &bench::possible(&environment, &watch)?);
        return Ok(());
    }
    // Criterion distinguishes a test of benches from a run in the same way.
    if has("--test") || !has("--bench") {
        eprintln!("nothing is measured: run it by cargo bench");
        return Ok(());
    }
    let asked = asked(arguments)?;
    if asked.is_empty() {
        eprintln!("nothing is measured: no bench is called so; cargo bench -- --list shows their names");
        return Ok(());
    }
    let results = Path::new(env!("CARGO_TARGET_TMPDIR")).with_file_name("bench-results");
    bench::run(&|id| asked.contains(id), &results, &environment, &watch, |benches| {
        replay::replay(&mut criterion, benches);
    })?;
    criterion.final_summary();
    Ok(())
}

/// The benches that criterion would run. Only criterion knows which benches its options leave, so it is asked to list
/// them.
fn asked(arguments: &[String]) -> Result<HashSet<String>, String> {
    let failed = |error: &dyn std::fmt::Display| format!("cannot list the benches: {error}");
    let program = std::env::current_exe().map_err(|error| failed(&error))?;
    let output = Command::new(program).args(arguments).arg("--list").output().map_err(|error| failed(&error))?;
    if !output.status.success() {
        return Err(failed(&String::from_utf8_lossy(&output.stderr)));
    }
    let lines = String::from_utf8_lossy(&output.stdout);
    Ok(lines.lines().filter_map(|line| line.strip_suffix(": benchmark")).map(str::to_owned).collect())
}
