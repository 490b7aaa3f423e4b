//! The summary of a batch, computed from the records of its pairs, so that it includes the work of earlier runs.

use std::{
    collections::HashSet,
    path::{Path, PathBuf},
};

use serde::Serialize;

use super::{
    Shard,
    job::Job,
    record::{PairRecord, PairTimes},
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
        jobs: &[Job<'_>],
        skipped: usize,
        failures: Vec<Failed>,
    ) -> Result<Self, Error> {
        let failed: HashSet<&Path> = failures.iter().map(|failed| failed.name.as_path()).collect();
        let done = Sum::of(jobs.iter().filter(|job| !failed.contains(job.pair.name.as_path())))?;
        let count = done.solve_ms.len();
        let rate = |ms: f64| (ms > 0.0 && count > 0).then(|| 1000.0 * count as f64 / ms);
        Ok(Self {
            shard: (!shard.is_all()).then(|| shard.to_string()),
            pairs: jobs.len(),
            done: count,
            skipped,
            failures,
            unread: Vec::new(),
            settings: done.settings,
            tiles: done.tiles,
            devices: done.devices,
            times: done.times,
            total_ms: done.total_ms,
            median_solve_ms: median(done.solve_ms),
            pairs_per_second: rate(done.total_ms),
            solved_per_second: rate(done.times.solve_ms),
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

/// What the records of pairs add up to. They are read one by one, because all of them may not fit in memory.
#[derive(Default)]
struct Sum {
    settings: Vec<description::Settings>,
    tiles: Vec<Tiles>,
    devices: Vec<description::Device>,
    times: PairTimes,
    total_ms: f64,
    solve_ms: Vec<f64>,
}

impl Sum {
    fn of<'a>(jobs: impl Iterator<Item = &'a Job<'a>>) -> Result<Self, Error> {
        let mut sum = Self::default();
        for job in jobs {
            let path = job.record();
            let gone = || Error::System(format!("{} is gone", path.display()));
            let PairRecord { elapsed_ms, done, .. } = PairRecord::known(&path)?.ok_or_else(gone)?;
            add_distinct(&mut sum.settings, Some(description::Settings { rows: None, ..done.settings }));
            add_distinct(&mut sum.tiles, done.tiles);
            add_distinct(&mut sum.devices, Some(done.device));
            sum.times = sum.times + done.times;
            sum.total_ms += elapsed_ms;
            sum.solve_ms.push(done.times.solve_ms);
        }
        Ok(sum)
    }
}

/// Adds a value to the distinct ones, in order of first appearance.
fn add_distinct<T: PartialEq>(found: &mut Vec<T>, value: Option<T>) {
    found.extend(value.filter(|value| !found.contains(value)));
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len().checked_sub(1)? / 2).copied()
}
