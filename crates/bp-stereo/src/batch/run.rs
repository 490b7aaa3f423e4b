//! Runs a batch on three threads: one reads, one matches and one writes, each a different pair.

use std::{
    collections::BTreeMap,
    io,
    sync::{
        Mutex, PoisonError,
        mpsc::{Receiver, SyncSender, sync_channel},
    },
    thread,
    time::Instant,
};

use bp_core::{DeviceKind, StereoPair};
use bp_io::{Limits, read_image};

use super::{
    BatchOptions,
    job::Job,
    record::{Done, FileState, PairRecord, PairTimes, history},
    summary::Failed,
};
use crate::{
    Beside, Cause, Content, Disparity, Error, Event, Making, Matcher, Memory, Start, Warning, Watch, description,
    pairs::Pair,
};

/// A pair in memory.
struct Read<'a> {
    job: &'a Job,
    inputs: Vec<FileState>,
    pair: Result<StereoPair, Error>,
    read_ms: f64,
}

/// An answer, not yet written.
struct Matched<'a> {
    job: &'a Job,
    origin: PairOrigin,
    answer: Result<Answer, Error>,
}

/// The inputs of an answer: its images, and the history of the earlier frames that its messages depend on.
struct PairOrigin {
    inputs: Vec<FileState>,
    follows: Option<String>,
}

struct Answer {
    done: Done,
    disparity: Disparity,
    pair: StereoPair,
}

/// A running batch.
pub(super) struct Run<'a> {
    pub(super) options: &'a BatchOptions,
    pub(super) making: &'a Making,
    pub(super) settings_sha256: &'a str,
    pub(super) watch: &'a Watch<'a>,
    pub(super) warned: Warned,
}

/// Counts the pairs with each warning. The first is reported at once; one sentence at the end counts the others.
#[derive(Default)]
pub(super) struct Warned(Mutex<BTreeMap<&'static str, usize>>);

impl Warned {
    fn count(&self, warning: &Warning) -> usize {
        let mut counts = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let count = counts.entry(warning.of_many()).or_default();
        *count += 1;
        *count
    }

    fn tell_others(&self, watch: &Watch<'_>) {
        let counts = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        for (what, count) in counts.iter().filter(|&(_, &count)| count > 1) {
            watch.warn(&format!("{} more pairs {what}; their records say how", count - 1));
        }
    }
}

impl Run<'_> {
    /// Matches and writes all jobs. If a pair fails, the others continue.
    pub(super) fn all(&self, jobs: &[&Job]) -> Result<Vec<Failed>, Error> {
        // The channels have no buffer, so at most three pairs are in memory.
        let (read, to_match) = sync_channel(0);
        let (matched, to_write) = sync_channel(0);
        let writer = Writer { run: self, pairs: jobs.len() as u64, last: Instant::now(), failed: Vec::new() };
        thread::scope(|scope| {
            scope.spawn(move || self.read_all(jobs, &read));
            let writer = scope.spawn(|| writer.write_all(to_write));
            let solved = self.solve_all(to_match, matched);
            let written = writer.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            self.warned.tell_others(self.watch);
            solved.map(|()| written)
        })
    }

    /// Reads one pair after another until the batch stops or the receiver is gone.
    fn read_all<'a>(&self, jobs: &[&'a Job], to: &SyncSender<Read<'a>>) {
        for &job in jobs {
            let start = Instant::now();
            // Recorded before the images are decoded, so that a later run notices any change since.
            let inputs: io::Result<Vec<FileState>> = job.images().into_iter().map(FileState::of).collect();
            let pair = read(self.options, &job.pair);
            let read = Read { job, inputs: inputs.unwrap_or_default(), pair, read_ms: milliseconds_since(start) };
            if self.watch.is_stopped() || to.send(read).is_err() {
                return;
            }
        }
    }

    /// Matches one pair after another. If the device is lost, it is opened again for the next pair.
    fn solve_all<'a>(&self, from: Receiver<Read<'a>>, to: SyncSender<Matched<'a>>) -> Result<(), Error> {
        let mut matcher = self.matcher()?;
        let mut before: Option<(usize, String)> = None;
        for Read { job, inputs, pair, read_ms } in from {
            // Never from the messages of another chain: the result must not depend on whether this run matched it.
            let follows = before.take().filter(|(chain, _)| *chain == job.chain).map(|(_, history)| history);
            let start = if follows.is_some() { Start::Warm } else { Start::Cold };
            let answer = pair.and_then(|pair| self.match_one(&mut matcher, job, pair, start, read_ms));
            let history = if answer.is_ok() { Some(history(follows.as_deref(), &inputs)) } else { follows.clone() };
            before = history.map(|history| (job.chain, history));
            let cause = answer.as_ref().err().map(Error::cause);
            if cause == Some(Cause::Stopped) {
                break;
            }
            if to.send(Matched { job, origin: PairOrigin { inputs, follows }, answer }).is_err() {
                break;
            }
            if cause == Some(Cause::DeviceLost) {
                matcher = self.matcher()?;
            }
        }
        Ok(self.watch.check()?)
    }

    fn matcher(&self) -> Result<Matcher, Error> {
        let depth = self.options.also.contains(&super::Also::Depth);
        let whole = self.options.warm_start.map(|_| "warm_start");
        Ok(Matcher::new(&self.options.matching)?.beside(Beside { truth: false, depth, batch: true, whole }))
    }

    fn match_one(
        &self,
        matcher: &mut Matcher,
        job: &Job,
        pair: StereoPair,
        start: Start,
        read_ms: f64,
    ) -> Result<Answer, Error> {
        let begun = Instant::now();
        let planned = matcher.plan(&pair)?;
        let warnings: Vec<String> = planned.warnings.iter().map(|warning| warning.about(&job.pair.images())).collect();
        // Warnings come before the check: exchanged images may be the reason that the outputs cannot hold the labels.
        let is_first = |warning: &Warning| self.warned.count(warning) == 1;
        let firsts = planned.warnings.iter().zip(&warnings).filter(|(warning, _)| is_first(warning));
        firsts.for_each(|(_, text)| self.watch.warn(text));
        job.outputs.check_plan(self.making, &planned.plan)?;
        // The batch counts pairs, not the work within one.
        let events = |event: Event<'_>| {
            if !matches!(event, Event::Progress { .. }) {
                self.watch.tell(event);
            }
        };
        let disparity = matcher.run(&pair, planned, start, &self.watch.with_events(&events))?;
        let times = PairTimes { read_ms, match_ms: milliseconds_since(begun), ..PairTimes::default() };
        Ok(Answer { done: done(matcher, &pair, &disparity, warnings, times), disparity, pair })
    }
}

/// Reads the images of a pair.
pub(super) fn read(options: &BatchOptions, pair: &Pair) -> Result<StereoPair, Error> {
    let limits = Limits::megapixels(options.max_megapixels);
    let limits = limits.within(Memory::available_to(DeviceKind::Processor));
    let images = StereoPair::new(read_image(&pair.left, limits)?, read_image(&pair.right, limits)?);
    images.map_err(|error| Error::from(error).of(pair.images()))
}

fn milliseconds_since(start: Instant) -> f64 {
    1000.0 * start.elapsed().as_secs_f64()
}

/// The record of an answer, without its outputs, which are not written yet.
fn done(matcher: &Matcher, pair: &StereoPair, disparity: &Disparity, warnings: Vec<String>, times: PairTimes) -> Done {
    let solve_ms = 1000.0 * disparity.times.total().as_secs_f64();
    Done {
        outputs: Vec::new(),
        width: pair.size().width,
        height: pair.size().height,
        backend: matcher.device_name().to_owned(),
        device: description::Device::from(matcher.device()),
        settings: disparity.settings.clone(),
        tiles: disparity.tiles.clone(),
        energy: disparity.energy.into(),
        warnings,
        times: PairTimes { solve_ms, ..times },
    }
}

/// Writes the outputs and then the record of each pair.
struct Writer<'a> {
    run: &'a Run<'a>,
    pairs: u64,
    last: Instant,
    failed: Vec<Failed>,
}

impl Writer<'_> {
    fn write_all(mut self, from: Receiver<Matched<'_>>) -> Vec<Failed> {
        for (index, Matched { job, origin, answer }) in from.into_iter().enumerate() {
            if let Err(error) = self.finish(job, &origin, answer) {
                job.remove_stale(&origin.inputs);
                self.failed.push(Failed::told(&job.pair, &error, self.run.watch));
            }
            let failed = if self.failed.is_empty() { String::new() } else { format!(", {} failed", self.failed.len()) };
            self.run.watch.tell(Event::Task(&format!("{} pairs{failed}", index + 1)));
            // Only the matching thread stops. Answers that it has handed over are still written.
            let _ = self.run.watch.progress(index as u64 + 1, self.pairs);
        }
        self.failed
    }

    /// Writes the outputs of an answer, then its record.
    fn finish(&mut self, job: &Job, origin: &PairOrigin, answer: Result<Answer, Error>) -> Result<(), Error> {
        let done = self.write(job, answer?)?;
        job.remove_others();
        self.record(job, origin, done)
    }

    fn record(&mut self, job: &Job, origin: &PairOrigin, done: Done) -> Result<(), Error> {
        let elapsed_ms = milliseconds_since(self.last);
        self.last = Instant::now();
        let record = PairRecord {
            name: job.pair.name.clone(),
            left: job.pair.left.clone(),
            right: job.pair.right.clone(),
            follows: origin.follows.clone(),
            settings_sha256: self.run.settings_sha256.to_owned(),
            inputs: origin.inputs.clone(),
            elapsed_ms,
            done,
        };
        record.write(&self.run.making.files, &job.record)
    }

    fn write(&self, job: &Job, Answer { done, disparity, pair }: Answer) -> Result<Done, Error> {
        let start = Instant::now();
        let content = Content {
            map: &disparity.map,
            confidence: disparity.confidence.as_deref(),
            image: Some(pair.left()),
            plan: Some(&disparity.settings),
            inputs: &job.inputs(),
        };
        job.outputs.write(self.run.making, &content, self.run.watch)?;
        let state = |path| FileState::of(path).map_err(|error| bp_io::Error::writing(path, &error));
        let outputs = job.paths.iter().map(|path| state(path)).collect::<Result<_, _>>()?;
        Ok(Done { outputs, times: PairTimes { write_ms: milliseconds_since(start), ..done.times }, ..done })
    }
}
