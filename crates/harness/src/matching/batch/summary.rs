//! What came of all pairs, computed from their records, so that it covers what earlier commands have done.

use std::{
    collections::HashSet,
    fmt::Write as _,
    path::{Path, PathBuf},
};

use serde::Serialize;

use super::{
    Shard,
    job::Job,
    record::{Done, PairRecord, PairTimes},
};
use crate::{
    args::MatchArgs,
    failure::Failure,
    files::write_json,
    matching::{Tiles, pairs::Pair},
    record,
};

/// What `--json` prints and summary.json holds.
#[derive(Serialize)]
pub(super) struct Summary {
    /// I/N, where the work is shared.
    shard: Option<String>,
    pairs: usize,
    done: usize,
    /// Pairs among these that were complete before this command.
    skipped: usize,
    failures: Vec<Failed>,
    /// Of every size of images, in the order in which they first came.
    settings: Vec<record::Settings>,
    /// Those of pairs that were not matched as a whole.
    tiles: Vec<Tiles>,
    devices: Vec<record::Device>,
    /// Sums over all pairs.
    times: PairTimes,
    /// The whole time, start-up and failures before the last pair that is done included.
    total_ms: f64,
    median_solve_ms: Option<f64>,
    pairs_per_second: Option<f64>,
    /// Of matching alone, from images in memory to labels in memory.
    solved_per_second: Option<f64>,
    output: PathBuf,
}

/// A pair that could not be matched, and why.
#[derive(Serialize)]
pub(super) struct Failed {
    name: PathBuf,
    left: PathBuf,
    right: PathBuf,
    failure: String,
}

/// The file of a summary.
pub(super) fn path(output: &Path, shard: Shard) -> PathBuf {
    output.join(if shard.is_all() { "summary.json".to_owned() } else { format!("summary-{}.json", shard.file_part()) })
}

impl Summary {
    /// The summary of a shard's pairs, of which these have failed just now.
    pub(super) fn of(
        args: &MatchArgs,
        shard: Shard,
        jobs: &[Job],
        skipped: usize,
        failures: Vec<Failed>,
    ) -> Result<Self, Failure> {
        let missing = |job: &Job| Failure::other(format!("{} is not there any more", job.record.display()));
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
            output: args.output.clone(),
        })
    }

    /// Writes it.
    pub(super) fn write(&self, path: &Path) -> Result<(), Failure> {
        write_json(path, self)
    }

    /// The summary as text.
    pub(super) fn text(&self) -> String {
        let Self { pairs, done, skipped, .. } = self;
        let shard = self.shard.as_ref().map_or_else(String::new, |shard| format!(" of shard {shard}"));
        let mut text = String::new();
        let failed = self.failures.len();
        let _ = writeln!(text, "{:<10}{pairs}{shard}: {done} done, {skipped} of them before, {failed} failed", "pairs");
        let PairTimes { read_ms, match_ms, write_ms, .. } = self.times;
        let [read, matching, written, total] = [read_ms, match_ms, write_ms, self.total_ms].map(|ms| ms / 1000.0);
        let parts = format!("{read:.1} s reading, {matching:.1} s matching, {written:.1} s writing, at the same time");
        let _ = writeln!(text, "{:<10}{total:.1} s in all; {parts}", "time");
        if let (Some(all), Some(solved), Some(median)) =
            (self.pairs_per_second, self.solved_per_second, self.median_solve_ms)
        {
            let alone = format!("{solved:.2} of matching alone (median {median:.1} ms)");
            let _ = writeln!(text, "{:<10}{all:.2} pairs a second from file to file, {alone}", "rate");
        }
        let _ = writeln!(text, "{:<10}{}", "written", self.output.display());
        text
    }

    /// Fails where a pair has, as the file that was written tells.
    pub(super) fn outcome(&self, told: &Path) -> Result<(), Failure> {
        let (failed, pairs) = (self.failures.len(), self.pairs);
        if failed == 0 {
            return Ok(());
        }
        Err(Failure::input(format!("{failed} of {pairs} pairs failed; {} tells why", told.display())))
    }
}

impl Failed {
    /// What is told of a pair that has failed.
    pub(super) fn new(pair: &Pair, failure: &Failure) -> Self {
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
