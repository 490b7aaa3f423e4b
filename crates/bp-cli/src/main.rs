//! The program `bp`.
//!
//! `args` reads the command line, and `args/meaning` turns it into the libraries' options. `commands` has one file for
//! each command, `terminal` shows the libraries' events, and `failure` defines the exit codes. Only this crate prints.

mod args;
mod bar;
mod colour_bar;
mod commands;
mod failure;
mod heap;
mod interrupt;
mod notes;
mod shortage;
mod terminal;

use std::{env, process::ExitCode};

use args::{Cli, Command};
use clap::Parser;
use failure::Failure;
use harness::threads;
use notes::{printable, tell};

fn main() -> ExitCode {
    notes::quieten_driver();
    interrupt::survive_size_limit();
    shortage::set_up();
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return misunderstood(&error),
    };
    notes::set_up(cli.quiet);
    match args::check_environment().and_then(|()| run(&cli.command)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            if failure.code() != 0 {
                tell(&format!("bp: {failure}"));
            }
            ExitCode::from(failure.code())
        }
    }
}

/// Tells what is wrong with the arguments, or shows the help that they ask for. Messages repeat arguments: those that a terminal
/// would obey are shown without colours, as escapes.
fn misunderstood(error: &clap::Error) -> ExitCode {
    let is_plain = |argument: String| printable(&argument) == argument;
    if env::args_os().all(|argument| is_plain(argument.to_string_lossy().into_owned())) {
        // As clap does: nothing can be done if nobody reads it.
        drop(error.print());
    } else {
        tell(error.to_string().trim_end());
    }
    u8::try_from(error.exit_code()).map_or(ExitCode::FAILURE, ExitCode::from)
}

fn run(command: &Command) -> Result<(), Failure> {
    threads::start()?;
    match command {
        Command::Match(args) => commands::match_pair(args),
        Command::Rectify(args) => commands::rectify(args),
        Command::Convert(args) => commands::convert(args),
        Command::Evaluate(args) => commands::evaluate(args),
        Command::Reproduce(args) => commands::reproduce(args),
        Command::Report(args) => commands::report(args),
        Command::Scenes(args) => commands::scenes(args),
        Command::Devices(args) => commands::devices(args),
        Command::Doctor(args) => threads::run_on(None, || commands::doctor(args)),
        Command::Conform(args) => threads::run_on(None, || commands::conform(args)),
        Command::Speed(args) => commands::speed(args),
        Command::Gate(args) => commands::gate(args),
        Command::Compare(args) => commands::compare(args),
        Command::Export(args) => commands::export(args),
        Command::Completions(args) => commands::completions(args),
        Command::Man(args) => commands::man(args),
    }
}
