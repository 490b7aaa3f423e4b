//! `bp export`: a record for other programs.

use std::io::Write;

use crate::{
    args::ExportArgs,
    export,
    failure::Failure,
    files::{check_writable, write_text},
    note,
    record::{load, record_file},
};

/// Runs the command.
pub(crate) fn export(args: &ExportArgs) -> Result<(), Failure> {
    if let Some(output) = &args.output {
        bp_io::check_distinct(&record_file(&args.record), output, "is read, and would be overwritten")?;
        check_writable(output)?;
    }
    let record = load(&args.record)?;
    if !export::has_numbers(&record) {
        return Err(Failure::reading(&args.record, &"nothing in it was measured; run `bp reproduce` to its end"));
    }
    let text = export::export(&record, args.format)?;
    let Some(output) = &args.output else { return Ok(write!(std::io::stdout(), "{text}")?) };
    write_text(output, &text)?;
    note(&format!("written: {}", output.display()));
    Ok(())
}
