//! The thesis's tables by `cargo bench`: every algorithm on every scene and backend, in turns.
//!
//! `[BP_BENCH=quick] [BP_BENCH_BACKEND=NAMES] [BP_DATA=DIR] cargo bench --bench thesis [-- SCENE...]`
//!
//! This is `bp reproduce` with more rounds. Criterion has no part in it: it would measure one plan after another, and on a
//! machine that is never quiet, minutes would pass between two algorithms whose ratio is the result. It measures what needs no
//! ratio, in `benches/matches.rs`.

use std::{path::Path, process::ExitCode};

use bp_stereo::{Event, Stop, Watch};
use harness::bench::{self, Settings};

fn main() -> ExitCode {
    match run(&std::env::args().skip(1).collect::<Vec<_>>()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}

fn tell(event: Event<'_>) {
    match event {
        Event::Line(line) | Event::Note(line) => eprintln!("{line}"),
        Event::Warning(line) => eprintln!("warning: {line}"),
        _ => {}
    }
}

fn run(arguments: &[String]) -> Result<(), String> {
    let (options, scenes): (Vec<_>, Vec<_>) = arguments.iter().partition(|argument| argument.starts_with('-'));
    let has = |option: &str| options.iter().any(|argument| *argument == option);
    let known = ["--bench", "--test", "--list", "--quiet"];
    if let Some(option) = options.iter().find(|option| !known.contains(&option.as_str())) {
        return Err(format!("{option}: this bench only takes scenes; for criterion's options, name --bench matches"));
    }
    // Cargo and criterion distinguish a run of benches from a test of them in the same way.
    if !has("--bench") || has("--test") || has("--list") {
        eprintln!("nothing is measured: run it by cargo bench");
        return Ok(());
    }
    let stop = Stop::default();
    let asks = stop.clone();
    let stops = move || {
        if asks.stop() {
            std::process::exit(130);
        }
    };
    ctrlc::set_handler(stops).map_err(|error| format!("cannot handle Ctrl-C: {error}"))?;
    let results = Path::new(env!("CARGO_TARGET_TMPDIR")).with_file_name("bench-results");
    let settings = Settings::read(|name| std::env::var_os(name));
    settings
        .and_then(|settings| bench::thesis(&settings, &scenes, &results, &Watch::new(&tell, &stop)))
        .map_err(|failure| failure.to_string())
}
