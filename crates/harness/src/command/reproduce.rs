//! `bp reproduce`: the thesis's experiments.

use crate::{args::ReproduceArgs, failure::Failure, interrupt, reproduce, threads};

/// Runs the command.
pub(crate) fn reproduce(args: &ReproduceArgs) -> Result<(), Failure> {
    interrupt::listen()?;
    let run = || interrupt::watched(|watch| reproduce::reproduce(&args.options(), watch));
    threads::run_on(args.threads, run)
}
