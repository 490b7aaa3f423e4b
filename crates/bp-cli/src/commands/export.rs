//! `bp export`: writes a record in the format of another program.

use std::io::Write;

use bp_io::{Error, Files};
use harness::{
    export,
    record::{load, record_file},
};

use crate::{args::ExportArgs, failure::Failure, notes::note};

/// Runs the command.
pub(crate) fn export(args: &ExportArgs) -> Result<(), Failure> {
    if let Some(output) = &args.output {
        bp_io::check_distinct(&record_file(&args.record), output, "is an input and would be overwritten")?;
        Files::default().check_writable(output)?;
    }
    let record = load(&args.record)?;
    if !export::has_numbers(&record) {
        let what = "it holds no measurements; run `bp reproduce` to its end";
        return Err(Error::reading(&args.record, &what).into());
    }
    let text = export::export(&record, args.format)?;
    let Some(output) = &args.output else { return Ok(write!(std::io::stdout(), "{text}")?) };
    Files::default().text(output, &text)?;
    note(&format!("written: {}", output.display()));
    Ok(())
}
