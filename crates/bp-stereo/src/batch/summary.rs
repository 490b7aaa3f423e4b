//! The summary of a batch, computed from the records of its pairs, so that it covers what earlier runs did.

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

use crate::{Error, Tiles, description, pairs::Pair};

/// What `--json` prints and summary.json holds.
#[derive(Serialize)]
pub struct Summary {
    /// I/N, where the work is shared.
    pub shard: Option<String>,
    /// Pairs of the shard.
    pub pairs: usize,
    /// Pairs that are done, now or before.
    pub done: usize,
    /// Pairs among these that were complete before this command.
    pub skipped: usize,
    /// Pairs that failed now.
    pub failures: Vec<Failed>,
    /// Of every size of images, in the order in which they first came.
    pub settings: Vec<description::Settings>,
    /// Those of pairs that were not matched as a whole.
    pub tiles: Vec<Tiles>,
    /// Devices that matched them.
    pub devices: Vec<description::Device>,
    /// Sums over all pairs.
    pub times: PairTimes,
    /// The whole time, start-up and failures before the last pair that is done included.
    pub total_ms: f64,
    /// Median milliseconds from images in memory to the map in memory.
    pub median_solve_ms: Option<f64>,
    /// Rate from file to file.
    pub pairs_per_second: Option<f64>,
    /// Of matching alone, from images in memory to labels in memory.
    pub solved_per_second: Option<f64>,
    /// The folder of the outputs.
    pub output: PathBuf,
}

/// A pair that could not be matched, and why.
#[derive(Serialize)]
pub struct Failed {
    /// The name of its outputs.
    pub name: PathBuf,
    /// The left image.
    pub left: PathBuf,
    /// The right image.
    pub right: PathBuf,
    /// Why.
    pub failure: String,
}

impl Summary {
    /// Sums up a shard's jobs, of which these failed just now.
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
        // From 0: the sum of no numbers is -0, and is written so.
        let total_ms = records.iter().fold(0.0, |sum, record| sum + record.elapsed_ms);
        let rate = |ms: f64| (ms > 0.0 && !done.is_empty()).then(|| 1000.0 * done.len() as f64 / ms);
        Ok(Self {
            shard: (!shard.is_all()).then(|| shard.to_string()),
            pairs: jobs.len(),
            done: done.len(),
            skipped,
            failures,
            settings: distinct(done.iter().map(|done| &done.settings)),
            tiles: distinct(done.iter().filter_map(|done| done.tiles.as_ref())),
            devices: distinct(done.iter().map(|done| &done.device)),
            times,
            total_ms,
            median_solve_ms: median(done.iter().map(|done| done.times.solve_ms).collect()),
            pairs_per_second: rate(total_ms),
            solved_per_second: rate(times.solve_ms),
            output: output.to_owned(),
        })
    }

    /// Writes it.
    pub(super) fn write(&self, files: &Files, path: &Path) -> Result<(), Error> {
        Ok(files.json(path, self)?)
    }
}

impl Failed {
    /// A pair that failed.
    pub(super) fn new(pair: &Pair, failure: &Error) -> Self {
        let Pair { name, left, right } = pair.clone();
        Self { name, left, right, failure: failure.to_string() }
    }
}

/// All different values, each once.
fn distinct<'a, T: Clone + PartialEq + 'a>(values: impl Iterator<Item = &'a T>) -> Vec<T> {
    let mut found: Vec<T> = Vec::new();
    for value in values {
        if !found.contains(value) {
            found.push(value.clone());
        }
    }
    found
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len().checked_sub(1)? / 2).copied()
}
