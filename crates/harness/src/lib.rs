//! The `bp` program: commands, files, scenes, records, reports.
//!
//! `command` holds one file a command, `matching` what happens to a pair, `reproduce` runs the thesis's experiments and
//! records them, `report` makes tables, charts and pages from records, `compare` and `export` set several beside one
//! another and hand one to other programs, `gate` holds speed-ups against committed baselines. `bench` is what `cargo
//! bench` runs. `backends` is the only file that lists backends.

mod args;
mod backends;
pub mod bench;
mod colour_bar;
mod command;
mod compare;
mod export;
mod failure;
mod files;
#[cfg(feature = "fuzzing")]
pub mod fuzzing;
mod gate;
mod heap;
mod interrupt;
mod machine;
mod measure;
mod notes;
pub mod record;
pub mod report;
pub mod reproduce;
mod scenes;
mod speed;
mod statistics;
mod summary;
mod terminal;
mod threads;

use std::process::ExitCode;

use args::{Cli, Command};
use clap::Parser;
use failure::Failure;
use notes::{note, tell};

/// Runs the program; the exit codes are documented in `bp --help`.
#[must_use]
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    notes::set_up(cli.quiet);
    match run(&cli.command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            if failure.code() != 0 {
                tell(&format!("bp: {failure}"));
            }
            ExitCode::from(failure.code())
        }
    }
}

fn run(command: &Command) -> Result<(), Failure> {
    match command {
        Command::Match(args) => command::match_pair(args),
        Command::Convert(args) => command::convert(args),
        Command::Evaluate(args) => command::evaluate(args),
        Command::Reproduce(args) => command::reproduce(args),
        Command::Report(args) => report::command(args),
        Command::Scenes(args) => command::scenes(args),
        Command::Devices(args) => threads::run_on(None, || command::devices(args)),
        Command::Doctor(args) => threads::run_on(None, || command::doctor(args)),
        Command::Conform(args) => threads::run_on(None, || command::conform(args)),
        Command::Speed(args) => command::speed(args),
        Command::Gate(args) => command::gate(args),
        Command::Compare(args) => command::compare(args),
        Command::Export(args) => command::export(args),
        Command::Completions(args) => command::completions(args),
        Command::Man(args) => command::man(args),
    }
}
