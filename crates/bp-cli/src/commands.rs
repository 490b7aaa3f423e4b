//! The commands, one file each.

mod compare;
mod conform;
mod convert;
mod devices;
mod doctor;
pub(crate) mod evaluate;
mod export;
mod gate;
mod match_pair;
mod match_report;
mod match_stream;
mod match_summary;
mod rectify;
mod report;
mod reproduce;
pub(crate) mod scenes;
mod shell;
mod speed;

use std::io::Write;

pub(crate) use compare::compare;
pub(crate) use conform::conform;
pub(crate) use convert::convert;
pub(crate) use devices::devices;
pub(crate) use doctor::doctor;
pub(crate) use evaluate::evaluate;
pub(crate) use export::export;
pub(crate) use gate::gate;
pub(crate) use match_pair::match_pair;
pub(crate) use rectify::rectify;
pub(crate) use report::report;
pub(crate) use reproduce::reproduce;
pub(crate) use scenes::scenes;
pub(crate) use shell::{completions, man};
pub(crate) use speed::speed;

use crate::{failure::Failure, notes::printable};

/// Prints a text on standard output.
fn print(text: &str) -> Result<(), Failure> {
    Ok(write!(std::io::stdout(), "{}", printable(text))?)
}

/// Prints a report as JSON.
pub(crate) fn print_json(report: &impl serde::Serialize) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    serde_json::to_writer_pretty(&mut out, report).map_err(std::io::Error::from)?;
    Ok(writeln!(out)?)
}

/// Width of printed text in columns.
const COLUMNS: usize = 110;

/// Wraps a text. All lines but the first are indented by `indent` spaces.
fn indented(text: &str, indent: usize) -> String {
    let (mut lines, mut column) = (String::new(), indent);
    for word in text.split_whitespace() {
        let room = column + word.chars().count() < COLUMNS;
        let gap = if lines.is_empty() {
            String::new()
        } else if room {
            " ".to_owned()
        } else {
            format!("\n{:indent$}", "")
        };
        column = if room { column } else { indent } + word.chars().count() + 1;
        lines += &(gap + word);
    }
    lines
}
