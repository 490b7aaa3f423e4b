//! Arguments for recorded runs.

use std::path::PathBuf;

use clap::Args;

use super::named;
use harness::export::Format;

/// `bp report`.
#[derive(Debug, Args)]
pub(crate) struct ReportArgs {
    /// A recorded run: the folder of a record.json.
    pub(crate) run: PathBuf,
    /// Instead of the report, write the run's chart and table between the markers of this file.
    #[arg(long, value_name = "FILE")]
    pub(crate) readme: Option<PathBuf>,
}

/// `bp compare`.
#[derive(Debug, Args)]
pub(crate) struct CompareArgs {
    /// Recorded runs with the same images, labels (L) and loops (k): each a record.json or its folder. The others are
    /// compared with the first.
    #[arg(required = true, num_args = 2.., value_name = "RECORD")]
    pub(crate) records: Vec<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// `bp export`.
#[derive(Debug, Args)]
pub(crate) struct ExportArgs {
    /// A recorded run: a record.json or its folder.
    pub(crate) record: PathBuf,
    /// Format: input for github-action-benchmark (customSmallerIsBetter) or Bencher (Bencher Metric Format), a table
    /// with one row per sample, or a Vega-Lite chart.
    #[arg(long, value_parser = named(&Format::ALL, Format::name))]
    pub(crate) format: Format,
    /// The file to write. [default: standard output]
    #[arg(long, short, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
}
