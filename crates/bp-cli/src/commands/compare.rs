//! `bp compare`: compares records of several machines, commits or backends in one table.

use std::path::Path;

use super::{print, print_json};
use harness::{
    compare::{Comparison, page},
    record::{Record, load},
};

use crate::{args::CompareArgs, failure::Failure};

/// Runs the command.
pub(crate) fn compare(args: &CompareArgs) -> Result<(), Failure> {
    let read = |path| Ok((path, load(path)?));
    let records: Vec<(&Path, Record)> =
        args.records.iter().map(|path| read(path.as_path())).collect::<Result<_, Failure>>()?;
    let comparison = Comparison::new(&records)?;
    if args.json {
        return print_json(&comparison);
    }
    print(&page(&comparison))
}
