//! The summary of a batch, computed from the records of its pairs, so that it includes the work of earlier runs.

use std::{
    collections::HashSet,
    path::{Path, PathBuf},
};

use serde::Serialize;

use super::{
    Shard,
    job::Job,
    record::{Done, PairRecord, PairTimes},
};
use bp_io::Files;

use crate::{Error, Event, Tiles, Watch, description, pairs::Pair};

/// The contents of summary.json and of `--json`.
#[derive(Serialize)]
pub struct Summary {
    /// I/N if the batch is shared by several processes.
    pub shard: Option<String>,
    /// Pairs of the shard.
    pub pairs: usize,
    /// Pairs that are done, by this run or an earlier one.
    pub done: usize,
    /// Pairs among these that were complete before this run.
    pub skipped: usize,
    /// Pairs that failed in this run.
    pub failures: Vec<Failed>,
    /// Folders that could not be searched for pairs, and why.
    pub unread: Vec<String>,
    /// The distinct settings of the pairs, in order of first appearance, without the rows of single pairs.
    pub settings: Vec<description::Settings>,
    /// The distinct tilings of the pairs that were not matched as a whole.
    pub tiles: Vec<Tiles>,
    /// The distinct devices that matched the pairs.
    pub devices: Vec<description::Device>,
    /// Sums over all pairs.
    pub times: PairTimes,
    /// Total time in milliseconds, including start-up and failures before the last completed pair.
    pub total_ms: f64,
    /// Median milliseconds from images in memory to the map in memory.
    pub median_solve_ms: Option<f64>,
    /// Throughput from file to file.
    pub pairs_per_second: Option<f64>,
    /// Throughput of matching alone, from images in memory to the map in memory.
    pub solved_per_second: Option<f64>,
    /// The folder of the outputs.
    pub output: PathBuf,
}

/// A pair that could not be matched, and why.
#[derive(Serialize)]
pub struct Failed {
    /// The name of the pair and its outputs.
    pub name: PathBuf,
    /// The left image.
    pub left: PathBuf,
    /// The right image.
    pub right: PathBuf,
    /// The reason.
    pub failure: String,
}

impl Summary {
    /// Summarises the jobs of a shard; `failures` are those of this run.
    pub(super) fn of(
        output: &Path,
        shard: Shard,
        jobs: &[Job],
        skipped: usize,
        failures: Vec<Failed>,
    ) -> Result<Self, Error> {
        let missing = |job: &Job| Error::System(format!("{} is gone", job.record.display()));
        let read = |job: &Job| PairRecord::read(&job.record).ok_or_else(|| missing(job));
        let failed: HashSet<&Path> = failures.iter().map(|failed| failed.name.as_path()).collect();
        let succeeded = jobs.iter().filter(|job| !failed.contains(job.pair.name.as_path()));
        let records = succeeded.map(read).collect::<Result<Vec<_>, _>>()?;
        let done: Vec<&Done> = records.iter().map(|record| &record.done).collect();
        let times = done.iter().fold(PairTimes::default(), |sum, done| sum + done.times);
        // Starts from 0.0 because the empty `sum` is -0.0, which would be written as such.
        let total_ms = records.iter().fold(0.0, |sum, record| sum + record.elapsed_ms);
        let rate = |ms: f64| (ms > 0.0 && !done.is_empty()).then(|| 1000.0 * done.len() as f64 / ms);
        Ok(Self {
            shard: (!shard.is_all()).then(|| shard.to_string()),
            pairs: jobs.len(),
            done: done.len(),
            skipped,
            failures,
            unread: Vec::new(),
            settings: distinct(done.iter().map(|done| description::Settings { rows: None, ..done.settings.clone() })),
            tiles: distinct(done.iter().filter_map(|done| done.tiles.clone())),
            devices: distinct(done.iter().map(|done| done.device.clone())),
            times,
            total_ms,
            median_solve_ms: median(done.iter().map(|done| done.times.solve_ms).collect()),
            pairs_per_second: rate(total_ms),
            solved_per_second: rate(times.solve_ms),
            output: output.to_owned(),
        })
    }

    pub(super) fn write(&self, files: &Files, path: &Path) -> Result<(), Error> {
        Ok(files.json(path, self)?)
    }
}

impl Failed {
    pub(super) fn new(pair: &Pair, failure: &Error) -> Self {
        let Pair { name, left, right } = pair.clone();
        Self { name, left, right, failure: failure.to_string() }
    }

    /// The same, reported to the watch.
    pub(super) fn told(pair: &Pair, failure: &Error, watch: &Watch<'_>) -> Self {
        watch.tell(Event::Failed(&format!("{}: {failure}", pair.name.display())));
        Self::new(pair, failure)
    }
}

/// The distinct values, in order of first appearance.
fn distinct<T: PartialEq>(values: impl Iterator<Item = T>) -> Vec<T> {
    let mut found: Vec<T> = Vec::new();
    for value in values {
        if !found.contains(&value) {
            found.push(value);
        }
    }
    found
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len().checked_sub(1)? / 2).copied()
}
