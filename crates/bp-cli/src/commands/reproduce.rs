//! `bp reproduce`: the thesis's experiments.

use crate::{args::ReproduceArgs, failure::Failure, reproduce, terminal, threads};

/// Runs the command.
pub(crate) fn reproduce(args: &ReproduceArgs) -> Result<(), Failure> {
    terminal::listen()?;
    let run = || terminal::watched(|watch| reproduce::reproduce(&args.options(), watch));
    threads::run_on(args.threads, run)
}
