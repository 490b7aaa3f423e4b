//! `bp gate`: whether speed-ups, accuracy, energy and memory are still what they were.

use std::io::Write;

use super::print_json;
use crate::{args::GateArgs, failure::Failure, gate, interrupt, tell, threads};

/// Runs the command.
pub(crate) fn gate(args: &GateArgs) -> Result<(), Failure> {
    interrupt::listen()?;
    let judgement = threads::run_on(None, || gate::gate(args))?;
    if args.json {
        print_json(&judgement)?;
    } else {
        write!(std::io::stdout(), "{}", gate::page(&judgement))?;
    }
    if !judgement.written.is_empty() {
        tell(&format!("written: {}", judgement.written.join(" and ")));
        return Ok(());
    }
    let failures = judgement.failures();
    match &failures[..] {
        [] => Ok(()),
        [first, ..] => {
            let advice = "if that is meant, `bp gate --update` writes new baselines";
            Err(Failure::gate(format!("the gate failed in {} places, such as {first}; {advice}", failures.len())))
        }
    }
}
