//! Records in the formats of other programs.

mod benchmarks;
mod table;
mod vega;

use crate::{
    escape::printable,
    failure::Failure,
    record::{Measurement, Record, Sample},
    summary::{Group, groups, interval, mean_of_medians, samples},
};

/// A format of another program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Input of github-action-benchmark (customSmallerIsBetter).
    GithubActionBenchmark,
    /// Bencher Metric Format.
    Bencher,
    /// A table with a row for every sample.
    Csv,
    /// A Vega-Lite chart.
    VegaLite,
}

impl Format {
    /// All formats.
    pub const ALL: [Self; 4] = [Self::GithubActionBenchmark, Self::Bencher, Self::Csv, Self::VegaLite];

    /// Its name in `--format`.
    pub fn name(self) -> &'static str {
        match self {
            Self::GithubActionBenchmark => "github-action-benchmark",
            Self::Bencher => "bencher",
            Self::Csv => "csv",
            Self::VegaLite => "vega-lite",
        }
    }
}

/// Exports a record in a format.
pub fn export(record: &Record, format: Format) -> Result<String, Failure> {
    let json = |value: serde_json::Value| format!("{value:#}\n");
    match format {
        Format::GithubActionBenchmark => Ok(json(benchmarks::github_action_benchmark(record))),
        Format::Bencher => Ok(json(benchmarks::bencher(record))),
        Format::Csv => table::csv(record),
        Format::VegaLite => Ok(json(vega::chart(record))),
    }
}

/// A time of a plan on a backend: a mean over all scenes.
struct Timed<'a> {
    group: Group<'a>,
    /// The part of a solve that was timed.
    part: &'static str,
    ms: f64,
    /// A 95 % interval, if there are enough samples.
    interval_ms: Option<[f64; 2]>,
}

/// A part of a solve in words, and its time in a sample.
type Part = (&'static str, fn(&Sample) -> f64);

const PARTS: [Part; 2] = [("total", |sample| sample.total_ms), ("message passing", Sample::message_passing_ms)];

/// All times of a record. Skips plans that lack results for a scene.
fn times(record: &Record) -> Vec<Timed<'_>> {
    let timed = |(part, ms)| {
        groups(record).into_iter().filter_map(move |group| {
            let samples = samples(&group.whole()?, ms);
            Some(Timed { group, part, ms: mean_of_medians(&samples)?, interval_ms: interval(&samples) })
        })
    };
    PARTS.into_iter().flat_map(timed).collect()
}

impl Timed<'_> {
    /// The device's name.
    fn device(&self) -> String {
        device(&self.group)
    }

    /// A name that is the same for every run, but differs between data sets.
    fn name(&self, record: &Record) -> String {
        printable(&format!("{}/{}/{}", record.run.data, self.group.plan, self.group.backend))
    }
}

fn device(group: &Group<'_>) -> String {
    let device = group.cell().and_then(|cell| cell.device.as_ref());
    device.map_or_else(String::new, |device| printable(&device.name))
}

/// Describes the run for readers of its numbers.
fn setting(record: &Record) -> String {
    let (run, machine, program) = (&record.run, &record.machine, &record.program);
    let quick = if run.quick { ", a quick run" } else { "" };
    let changes = if program.clean_tree { "" } else { " with changes" };
    printable(&format!(
        "means over {} scenes of {}{quick}, L = {}, k = {}; {}, {} cores; commit {}{changes}",
        record.scenes.len(),
        run.data,
        run.labels,
        run.k,
        machine.cpu,
        machine.cores,
        program.commit
    ))
}

/// Whether anything was measured at all.
pub fn has_numbers(record: &Record) -> bool {
    let whole = |measured: &Measurement| !measured.samples.is_empty();
    record.cells.iter().filter_map(|cell| cell.measured()).any(whole)
}
