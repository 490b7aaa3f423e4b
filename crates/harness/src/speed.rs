//! `bp speed`: devices timed against each other on fixed problems, which need no files.

mod charts;
mod files;
mod problems;
mod run;
mod tables;

use std::path::PathBuf;

pub use files::{Files, is_record, renew};
pub use problems::Problem;
pub use run::{check, measure};
pub use tables::page;

/// What is measured.
#[derive(Debug, Default)]
pub struct SpeedOptions {
    /// The problems, by the names in [`Problem::ASKED`]; none means all but those that take long.
    pub problems: Vec<String>,
    /// Rounds, by default nine, or one in a quick run.
    pub rounds: Option<u32>,
    /// Images of a third of the width and height.
    pub quick: bool,
    /// The folder of the record, the page and the charts.
    pub output: Option<PathBuf>,
}
