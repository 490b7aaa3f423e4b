//! Runs a batch on three threads: one reads, one matches and one writes, each a different pair. With a limit of memory, one
//! pair after another.

use std::{
    collections::BTreeMap,
    path::Path,
    sync::{
        Mutex, PoisonError,
        mpsc::{Receiver, SyncSender, sync_channel},
    },
    thread,
    time::Instant,
};

use bp_core::StereoPair;

use super::{
    Also, BatchOptions,
    images::Images,
    job::Job,
    record::{Done, FileState, PairRecord, PairTimes, history},
    summary::Failed,
};
use crate::{
    Beside, Cause, Content, Disparity, Error, Event, Making, Matcher, Options, ReadPair, Start, Stopped, Warning,
    Watch, description, reading::Room,
};

/// A pair in memory.
struct Read<'a> {
    job: &'a Job<'a>,
    images: Images,
    read_ms: f64,
}

/// An answer, not yet written.
struct Matched<'a> {
    job: &'a Job<'a>,
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
    /// The bytes that the batch holds of all its pairs.
    pub(super) listed: u64,
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
    pub(super) fn all(&self, jobs: &[&Job<'_>]) -> Result<Vec<Failed>, Error> {
        let writer =
            Writer { run: self, pairs: jobs.len() as u64, last: Instant::now(), written: 0, failed: Vec::new() };
        let is_limited = self.options.matching.max_memory.is_some();
        let written = if is_limited { self.one_by_one(jobs, writer) } else { self.side_by_side(jobs, writer) };
        self.warned.tell_others(self.watch);
        written
    }

    /// Reads, matches and writes one pair after another, so that only one is in memory.
    fn one_by_one(&self, jobs: &[&Job<'_>], mut writer: Writer<'_>) -> Result<Vec<Failed>, Error> {
        let mut solver = PairSolver::new(self)?;
        for job in jobs {
            self.watch.check()?;
            let room = Room::new(self.options.max_megapixels, self.options.matching.max_memory);
            let room = room.without(self.listed);
            let beside = self.read(job, room.without(solver.matcher.allocated_bytes()))?;
            let is_short = beside.images.pair.as_ref().is_err_and(|error| error.cause() == Cause::Memory);
            // A warm start needs what the matcher holds, and a pipe is empty now.
            let again = self.options.warm_start.is_none() && job.images().into_iter().all(Path::is_file);
            let is_freed = is_short && again && solver.matcher.free();
            writer.write(solver.solve(if is_freed { self.read(job, room)? } else { beside })?);
        }
        Ok(writer.failed)
    }

    /// Reads, matches and writes three pairs at a time; one, if the system starts no threads.
    fn side_by_side(&self, jobs: &[&Job<'_>], mut writer: Writer<'_>) -> Result<Vec<Failed>, Error> {
        // The channels have no buffer, so at most three pairs are in memory.
        let (read, to_match) = sync_channel(0);
        let (matched, to_write) = sync_channel(0);
        let solved = thread::scope(|scope| {
            let write = || to_write.into_iter().for_each(|matched| writer.write(matched));
            let writing = thread::Builder::new().spawn_scoped(scope, write).ok()?;
            // Begins last, because what is read from a pipe cannot be read again.
            thread::Builder::new().spawn_scoped(scope, move || self.read_all(jobs, &read)).ok()?;
            let solved = self.solve_all(to_match, matched);
            writing.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            Some(solved)
        });
        match solved {
            Some(solved) => solved.map(|()| writer.failed),
            None => self.one_by_one(jobs, writer),
        }
    }

    /// Reads one pair after another until the batch stops or the receiver is gone.
    fn read_all<'a>(&self, jobs: &[&'a Job<'a>], to: &SyncSender<Read<'a>>) {
        for &job in jobs {
            let room = Room::new(self.options.max_megapixels, None);
            let Ok(read) = self.read(job, room) else { return };
            if self.watch.is_stopped() || to.send(read).is_err() {
                return;
            }
        }
    }

    fn read<'a>(&self, job: &'a Job<'a>, room: Room) -> Result<Read<'a>, Stopped> {
        let (start, pair, rectifying) = (Instant::now(), job.pair.clone(), self.making.rectifying.clone());
        let stretch = self.options.matching.stretch;
        let mut images =
            self.watch.unless_stopped(move || Images::read(&pair, room, rectifying.as_deref(), stretch))?;
        if !self.options.also.contains(&Also::Points) {
            let compared = |read: ReadPair| ReadPair { pair: self.options.matching.compared(read.pair), ..read };
            images.pair = images.pair.map(compared);
        }
        Ok(Read { job, images, read_ms: milliseconds_since(start) })
    }

    /// Matches one pair after another.
    fn solve_all<'a>(&self, from: Receiver<Read<'a>>, to: SyncSender<Matched<'a>>) -> Result<(), Error> {
        let mut solver = PairSolver::new(self)?;
        for read in from {
            if to.send(solver.solve(read)?).is_err() {
                break;
            }
        }
        Ok(self.watch.check()?)
    }

    fn matcher(&self) -> Result<Matcher, Error> {
        let depth = self.options.also.contains(&Also::Depth);
        let whole = self.options.warm_start.map(|_| "warm_start");
        let batch = self.options.matching.max_memory.is_none();
        // Records have it.
        let options = Options { energy: true, ..self.options.matching.clone() };
        Ok(Matcher::new(&options)?.beside(Beside {
            truth: false,
            masked: false,
            depth,
            rectified: self.making.rectifying.is_some(),
            batch,
            listed: self.listed,
            whole,
        }))
    }

    fn match_one(
        &self,
        matcher: &mut Matcher,
        job: &Job<'_>,
        ReadPair { pair, valid }: ReadPair,
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
        job.outputs().check_plan(self.making, &planned.plan)?;
        self.options.warm_start.map_or(Ok(()), |_| matcher.check_warm(&planned.plan))?;
        // The batch counts pairs, not the work within one.
        let events = |event: Event<'_>| {
            if !matches!(event, Event::Progress { .. }) {
                self.watch.tell(event);
            }
        };
        let mut disparity = matcher.run(&pair, planned, start, &self.watch.with_events(&events))?;
        valid.iter().for_each(|valid| disparity.restrict(valid));
        let times = PairTimes { read_ms, match_ms: milliseconds_since(begun), ..PairTimes::default() };
        Ok(Answer { done: done(matcher, &pair, &disparity, warnings, times), disparity, pair })
    }
}

/// Matches one pair after another on one device.
struct PairSolver<'a> {
    run: &'a Run<'a>,
    matcher: Matcher,
    /// The chain of the pair before, if it has an answer, and its history.
    before: Option<(usize, String)>,
    has_answered: bool,
}

impl<'r> PairSolver<'r> {
    fn new(run: &'r Run<'r>) -> Result<Self, Error> {
        Ok(Self { run, matcher: run.matcher()?, before: None, has_answered: false })
    }

    /// Matches a pair. What would fail for all pairs ends the batch: a stop, a lost device that cannot be opened again, or a warm
    /// start that the device cannot do.
    fn solve<'a>(&mut self, Read { job, images, read_ms }: Read<'a>) -> Result<Matched<'a>, Error> {
        let Images { pair, states: inputs } = images;
        // Never from the messages of another chain: the result must not depend on whether this run matched it.
        let follows = self.before.take().filter(|(chain, _)| *chain == job.chain).map(|(_, history)| history);
        let start = if follows.is_some() { Start::Warm } else { Start::Cold };
        let answer = pair.and_then(|pair| self.run.match_one(&mut self.matcher, job, pair, start, read_ms));
        let history = if answer.is_ok() { Some(history(follows.as_deref(), &inputs)) } else { follows.clone() };
        self.before = history.map(|history| (job.chain, history));
        self.has_answered |= answer.is_ok();
        match answer.as_ref().err().map(|error| (error.cause(), error)) {
            Some((Cause::Stopped, _)) => return Err(Error::Stopped),
            // The other frames of the video have the same plan.
            Some((Cause::Unsupported, error)) if self.run.options.warm_start.is_some() && !self.has_answered => {
                return Err(error.clone());
            }
            Some((Cause::DeviceLost, _)) => self.matcher = self.run.matcher()?,
            _ => {}
        }
        Ok(Matched { job, origin: PairOrigin { inputs, follows }, answer })
    }
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
        energy: disparity.energy.map(Into::into),
        warnings,
        times: PairTimes { solve_ms, ..times },
    }
}

/// Writes the outputs and then the record of each pair.
struct Writer<'a> {
    run: &'a Run<'a>,
    pairs: u64,
    last: Instant,
    written: u64,
    failed: Vec<Failed>,
}

impl Writer<'_> {
    /// Writes the files of a pair, or reports its failure.
    fn write(&mut self, Matched { job, origin, answer }: Matched<'_>) {
        if let Err(error) = self.finish(job, &origin, answer) {
            job.remove_stale(&origin.inputs);
            self.failed.push(Failed::told(job.pair, &error, self.run.watch));
        }
        self.written += 1;
        let failed = if self.failed.is_empty() { String::new() } else { format!(", {} failed", self.failed.len()) };
        self.run.watch.tell(Event::Task(&format!("{} pairs{failed}", self.written)));
        // Only the matching thread stops. Answers that it has handed over are still written.
        let _ = self.run.watch.progress(self.written, self.pairs);
    }

    /// Writes the outputs of an answer, then its record.
    fn finish(&mut self, job: &Job<'_>, origin: &PairOrigin, answer: Result<Answer, Error>) -> Result<(), Error> {
        let done = self.outputs(job, answer?)?;
        job.remove_others()?;
        self.record(job, origin, done)
    }

    fn record(&mut self, job: &Job<'_>, origin: &PairOrigin, done: Done) -> Result<(), Error> {
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
        record.write(&self.run.making.files, &job.record())
    }

    fn outputs(&self, job: &Job<'_>, Answer { done, disparity, pair }: Answer) -> Result<Done, Error> {
        let start = Instant::now();
        let content = Content {
            map: &disparity.map,
            confidence: disparity.confidence.as_deref(),
            image: Some(pair.left()),
            plan: Some(&disparity.settings),
            inputs: &job.inputs(),
        };
        job.outputs().write(self.run.making, &content, self.run.watch)?;
        let outputs = job.paths().iter().map(|path| FileState::of(path)).collect::<Result<_, _>>()?;
        Ok(Done { outputs, times: PairTimes { write_ms: milliseconds_since(start), ..done.times }, ..done })
    }
}
