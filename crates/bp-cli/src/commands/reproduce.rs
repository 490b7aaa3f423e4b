//! `bp reproduce`: repeats the thesis's experiments.

use harness::{reproduce, threads};

use crate::{args::ReproduceArgs, failure::Failure, interrupt, terminal};

/// Runs the command.
pub(crate) fn reproduce(args: &ReproduceArgs) -> Result<(), Failure> {
    interrupt::listen()?;
    let run = || terminal::watched(|watch| reproduce::reproduce(&args.options(), watch));
    Ok(threads::run_on(args.threads, run)?)
}
