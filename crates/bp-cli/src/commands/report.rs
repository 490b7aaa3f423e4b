//! `bp report`: rewrites the report of a recorded run, or the part of a page that is generated from it.

use crate::{args::ReportArgs, failure::Failure, notes::note};

/// Runs the command.
pub(crate) fn report(args: &ReportArgs) -> Result<(), Failure> {
    match &args.readme {
        None => note(&format!("report: {}", harness::renew(&args.run)?.display())),
        Some(page) => harness::report::renew_page(&args.run, page)?,
    }
    Ok(())
}
