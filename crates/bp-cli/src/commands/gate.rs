//! `bp gate`: checks speed-ups, accuracy, energy, memory and instruction counts against baselines.

use std::io::Write;

use serde::Serialize;

use super::print_json;
use harness::{gate, threads};

use crate::{args::GateArgs, failure::Failure, interrupt, notes::note, terminal};

/// Runs the command.
pub(crate) fn gate(args: &GateArgs) -> Result<(), Failure> {
    if let Some(solve) = args.counted {
        return Ok(writeln!(std::io::stdout(), "{}", solve.run()?)?);
    }
    interrupt::listen()?;
    if args.instructions {
        let judgement =
            threads::run_on(None, || terminal::watched(|watch| gate::instructions(&args.baselines, watch)))?;
        print(args, &judgement, &judgement.page())?;
        return if args.update.is_some() { written(&judgement.update()?) } else { conclude(&judgement.failures()) };
    }
    let judgement = threads::run_on(None, || terminal::watched(|watch| gate::gate(&args.options(), watch)))?;
    print(args, &judgement, &gate::page(&judgement))?;
    if args.update.is_some() {
        return written(&judgement.written.join(" and "));
    }
    if !judgement.written.is_empty() {
        written(&judgement.written.join(" and "))?;
    }
    if judgement.is_partial() {
        note(&format!("warning: only {}", judgement.summary()));
    }
    conclude(&judgement.failures())
}

fn print(args: &GateArgs, judgement: &impl Serialize, page: &str) -> Result<(), Failure> {
    if args.json { print_json(judgement) } else { super::print(page) }
}

fn written(files: &str) -> Result<(), Failure> {
    note(&format!("written: {files}"));
    Ok(())
}

fn conclude(failures: &[String]) -> Result<(), Failure> {
    let Some((first, others)) = failures.split_first() else { return Ok(()) };
    let more = if others.is_empty() { String::new() } else { format!("; and {} more", others.len()) };
    let advice = "if that is meant, write new baselines with --update (see --help)";
    Err(Failure::gate(format!("the gate failed: {first}{more}; {advice}")))
}
