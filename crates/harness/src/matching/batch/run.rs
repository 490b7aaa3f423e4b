//! Three threads, a pair in each: one reads, one matches, one writes.

use std::{
    io,
    sync::mpsc::{Receiver, SyncSender, sync_channel},
    thread,
    time::Instant,
};

use bp_core::{StereoPair, survey::Survey};

use super::{
    job::Job,
    record::{Done, FileState, PairRecord, PairTimes, history},
    summary::Failed,
};
use crate::{
    args::MatchArgs,
    command::match_pair::{planned, read_pair},
    failure::Failure,
    files::PixelLimit,
    interrupt::{self, ProgressBar},
    matching::{Answer, Content, Making, Session},
    record, tell,
};

/// A pair in memory.
struct Read<'a> {
    job: &'a Job,
    inputs: Vec<FileState>,
    pair: Result<(StereoPair, Survey), Failure>,
    read_ms: f64,
}

/// An answer, not yet written.
struct Matched<'a> {
    job: &'a Job,
    inputs: Vec<FileState>,
    follows: Option<String>,
    done: Result<(Done, Answer, StereoPair), Failure>,
}

/// Matches and writes all jobs; where a pair fails, the others go on.
pub(super) fn run(
    args: &MatchArgs,
    making: &Making,
    jobs: &[&Job],
    settings_sha256: &str,
) -> Result<Vec<Failed>, Failure> {
    let bar = ProgressBar::new(jobs.len() as u64);
    // Nothing waits in the channels: at most three pairs are in memory.
    let (read, to_match) = sync_channel(0);
    let (matched, to_write) = sync_channel(0);
    let limit = PixelLimit::megapixels(args.max_megapixels);
    let begun = Instant::now();
    let result = thread::scope(|scope| {
        scope.spawn(move || read_all(jobs, limit, &read));
        let writer = scope.spawn(|| {
            Writer { bar: &bar, making, settings_sha256, last: begun, failed: Vec::new() }.write_all(to_write)
        });
        let solved = solve_all(args, making, to_match, matched);
        let written = writer.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        // Where writing fails, matching ends for want of a writer.
        written.and_then(|failed| solved.map(|()| failed))
    });
    bar.finish();
    result
}

fn milliseconds_since(start: Instant) -> f64 {
    1000.0 * start.elapsed().as_secs_f64()
}

/// Reads pair after pair until nobody wants more.
fn read_all<'a>(jobs: &[&'a Job], limit: PixelLimit, to: &SyncSender<Read<'a>>) {
    for &job in jobs {
        let start = Instant::now();
        // Before they are read: whatever is written to them after this is noticed.
        let inputs: io::Result<Vec<FileState>> = job.images().into_iter().map(FileState::of).collect();
        let pair = read_pair(&job.pair.left, &job.pair.right, limit).and_then(|pair| {
            let survey = Survey::of(&pair)?;
            Ok((pair, survey))
        });
        let read = Read { job, inputs: inputs.unwrap_or_default(), pair, read_ms: milliseconds_since(start) };
        if interrupt::check().is_err() || to.send(read).is_err() {
            return;
        }
    }
}

/// Matches pair after pair. A device that is lost is opened again for the next.
fn solve_all<'a>(
    args: &MatchArgs,
    making: &Making,
    from: Receiver<Read<'a>>,
    to: SyncSender<Matched<'a>>,
) -> Result<(), Failure> {
    let mut session = Session::open(args)?;
    let mut before: Option<(usize, String)> = None;
    for Read { job, inputs, pair, read_ms } in from {
        // Not from another chain's messages: whether that is matched in this run must make no difference.
        let follows = before.take().filter(|(chain, _)| *chain == job.chain).map(|(_, history)| history);
        session.starts_warm = follows.is_some();
        let done = pair.and_then(|read| match_one(args, making, &mut session, job, read, read_ms));
        let history = if done.is_ok() { Some(history(follows.as_deref(), &inputs)) } else { follows.clone() };
        before = history.map(|history| (job.chain, history));
        if done.as_ref().is_err_and(Failure::is_interrupted) {
            break;
        }
        let is_lost = done.as_ref().is_err_and(Failure::is_device_lost);
        if to.send(Matched { job, inputs, follows, done }).is_err() {
            break;
        }
        if is_lost {
            session = Session::open(args)?;
        }
    }
    interrupt::check()
}

fn match_one(
    args: &MatchArgs,
    making: &Making,
    session: &mut Session<'_>,
    job: &Job,
    (pair, survey): (StereoPair, Survey),
    read_ms: f64,
) -> Result<(Done, Answer, StereoPair), Failure> {
    let start = Instant::now();
    let (plan, warnings) = planned(&args.plan, job.images(), pair.size(), &survey, (&job.outputs, making))?;
    let answer = session.solve(&pair, plan)?;
    let times = PairTimes { read_ms, match_ms: milliseconds_since(start), ..PairTimes::default() };
    Ok((done(session, &pair, &answer, warnings, times), answer, pair))
}

/// What is recorded of an answer, but for the files that are still to be written.
fn done(session: &Session<'_>, pair: &StereoPair, answer: &Answer, warnings: Vec<String>, times: PairTimes) -> Done {
    let solve_ms = answer.samples.iter().map(|sample| 1000.0 * sample.total().as_secs_f64()).sum();
    Done {
        outputs: Vec::new(),
        width: pair.size().width,
        height: pair.size().height,
        backend: session.opened().name.clone(),
        device: record::Device::from(&session.opened().info),
        settings: answer.settings.clone(),
        tiles: answer.tiles.clone(),
        energy: answer.energy.into(),
        warnings,
        times: PairTimes { solve_ms, ..times },
    }
}

/// Writes outputs and, after them, records.
struct Writer<'a> {
    bar: &'a ProgressBar,
    making: &'a Making,
    settings_sha256: &'a str,
    last: Instant,
    failed: Vec<Failed>,
}

impl Writer<'_> {
    fn write_all(mut self, from: Receiver<Matched<'_>>) -> Result<Vec<Failed>, Failure> {
        for (index, Matched { job, inputs, follows, done }) in from.into_iter().enumerate() {
            match done {
                Ok((done, answer, pair)) => {
                    let done = self.write(job, done, &answer, &pair)?;
                    job.remove_others();
                    self.record(job, (inputs, follows), done)?;
                }
                Err(failure) => {
                    tell(&format!("{}: {failure}", job.pair.name.display()));
                    job.remove_stale(&inputs);
                    self.failed.push(Failed::new(&job.pair, &failure));
                }
            }
            let failed = if self.failed.is_empty() { String::new() } else { format!(", {} failed", self.failed.len()) };
            self.bar.message(format!("{} pairs{failed}", index + 1));
            // Stopping is for the thread that matches; what it has handed over is still written.
            let _ = self.bar.update(index as u64 + 1);
        }
        Ok(self.failed)
    }

    fn record(
        &mut self,
        job: &Job,
        (inputs, follows): (Vec<FileState>, Option<String>),
        done: Done,
    ) -> Result<(), Failure> {
        let elapsed_ms = milliseconds_since(self.last);
        self.last = Instant::now();
        let record = PairRecord {
            name: job.pair.name.clone(),
            left: job.pair.left.clone(),
            right: job.pair.right.clone(),
            follows,
            settings_sha256: self.settings_sha256.to_owned(),
            inputs,
            elapsed_ms,
            done,
        };
        record.write(&job.record)
    }

    fn write(&self, job: &Job, done: Done, answer: &Answer, pair: &StereoPair) -> Result<Done, Failure> {
        let start = Instant::now();
        let inputs = job.inputs();
        let (image, plan) = (Some(pair.left()), Some(&answer.settings));
        let confidence = answer.confidence.as_deref();
        job.outputs.write(self.making, &Content { map: &answer.map, confidence, image, plan, inputs: &inputs })?;
        let state = |path| FileState::of(path).map_err(|error| Failure::writing(path, &error));
        let outputs = job.paths.iter().map(|path| state(path)).collect::<Result<_, _>>()?;
        Ok(Done { outputs, times: PairTimes { write_ms: milliseconds_since(start), ..done.times }, ..done })
    }
}
