//! Matches many pairs in one call. Complete pairs are skipped. The others are matched one after another on one device,
//! while the next pair is read and the previous one is written.
//!
//! The state of a batch lives in files alone, so a batch may end at any moment and in any way. Every output is written
//! whole. The record of a pair is written after its outputs and holds checksums of its images and outputs. Processes
//! that share a batch need no other files.

mod apart;
mod images;
mod job;
mod places;
mod record;
mod run;
mod shard;
mod summary;

use std::path::PathBuf;

use apart::check_apart;
use job::Job;
use places::Places;
pub use record::PairTimes;
use run::{Run, Warned};
use serde::{Deserialize, Serialize};
pub use shard::Shard;
pub use summary::{Failed, Summary};

use bp_io::{Files, MapFormat, create_folder};

use crate::{
    Align, Cause, Error, Event, Labels, Making, Options, Watch, align_camera,
    pairs::{Pair, Source, listed_bytes},
    read_pair, read_stretched_pair,
    reading::Room,
};

/// The pairs of a batch, how they are matched, and what is written.
#[derive(Clone, Debug)]
pub struct BatchOptions {
    /// The pairs.
    pub source: Source,
    /// The folder of the outputs.
    pub output: PathBuf,
    /// The file of the camera's alignment. If it is missing, it is measured and written. All pairs use it.
    pub alignment: Option<PathBuf>,
    /// How each pair is matched.
    pub matching: Options,
    /// Extension of the maps, which selects their format.
    pub format: String,
    /// The other outputs of each pair.
    pub also: Vec<Also>,
    /// Which pairs this process matches.
    pub shard: Shard,
    /// If set, each frame of a video starts from the messages of the previous frame, and every n-th frame starts cold.
    pub warm_start: Option<u32>,
    /// Whether complete pairs are matched again.
    pub force: bool,
    /// Most megapixels of an image.
    pub max_megapixels: u32,
}

impl BatchOptions {
    /// The length of a chain: consecutive pairs that depend on the first of them. A chain is matched as a whole or
    /// skipped.
    fn chain(&self) -> usize {
        self.warm_start.unwrap_or(1) as usize
    }
}

/// An output beside the map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Also {
    /// A coloured picture, NAME.picture.png.
    Picture,
    /// A depth map, NAME.depth with the extension of the maps.
    Depth,
    /// A point cloud, NAME.points.ply.
    Points,
    /// A confidence map, NAME.confidence with the extension of the maps.
    Confidence,
}

impl Also {
    /// All kinds.
    pub const ALL: [Self; 4] = [Self::Picture, Self::Depth, Self::Points, Self::Confidence];

    /// The name used in options.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Picture => "picture",
            Self::Depth => "depth",
            Self::Points => "points",
            Self::Confidence => "confidence",
        }
    }
}

/// Matches all pairs of a batch. `watch` receives notes, warnings, failures of single pairs, and progress in pairs.
///
/// # Errors
/// [`Error::Options`] and [`Error::Input`] before the work begins, [`Error::Stopped`], and errors that end the batch,
/// such as a device that is gone. A pair that fails, or whose outputs cannot be written, is an entry of
/// [`Summary::failures`].
pub fn run(options: &BatchOptions, making: &Making, watch: &Watch<'_>) -> Result<Summary, Error> {
    check(options, making)?;
    let max_memory = options.matching.max_memory;
    let found = options.source.find(&options.output, max_memory, watch)?;
    let listed = listed_bytes(&found.pairs, &options.output);
    Room::new(options.max_megapixels, max_memory).check_list(&options.source.to_string(), listed)?;
    found.notes.iter().for_each(|note| watch.note(note));
    found.unread.iter().for_each(|text| watch.tell(Event::Failed(text)));
    let shard = options.shard;
    let files = Files::of(&shard.file_part()).owning(&options.output);
    let making = &Making { files, ..making.clone() };
    let places = Places { options, making };
    let taken = check_apart(places, &found.pairs, watch)?;
    create_folder(&options.output)?;
    let jobs = job::jobs(places, &found, &taken);
    let _lock = shard.lock(&options.output.join(places::RECORDS), &making.files)?;
    making.files.check_writable(&shard.summary_path(&options.output))?;
    job::clear_leftovers(options, &jobs, &making.files, watch);
    let options = &with_alignment(options, &found.pairs, &making.files, watch)?;
    let settings_sha256 = record::settings_sha256(options, making)?;
    let mut due = Vec::new();
    for chain in jobs.chunk_by(|a, b| a.chain == b.chain) {
        watch.check()?;
        if options.force || !job::are_complete(chain, &settings_sha256) {
            due.extend(chain);
        }
    }
    let skipped = jobs.len() - due.len();
    let (due, mut failures) = writable(due, making, watch)?;
    let run = Run { options, making, listed, settings_sha256: &settings_sha256, watch, warned: Warned::default() };
    failures.extend(match_due(&run, &due)?);
    let summary = Summary::of(&options.output, shard, &jobs, skipped, failures)?;
    let summary = Summary { unread: found.unread, ..summary };
    summary.write(&making.files, &shard.summary_path(&options.output))?;
    Ok(summary)
}

/// The jobs whose files can be written, and those that fail because a name or what is there does not allow it. What is wrong
/// with the options fails for all.
fn writable<'a>(
    due: Vec<&'a Job<'a>>,
    making: &Making,
    watch: &Watch<'_>,
) -> Result<(Vec<&'a Job<'a>>, Vec<Failed>), Error> {
    let (mut writable, mut failures) = (Vec::new(), Vec::new());
    for job in due {
        watch.check()?;
        match job.check(making) {
            Ok(()) => writable.push(job),
            Err(error) if error.cause() != Cause::Options => failures.push(Failed::told(job.pair, &error, watch)),
            Err(error) => return Err(error),
        }
    }
    Ok((writable, failures))
}

/// The options with the alignment of the camera, if all pairs come from one.
fn with_alignment(
    options: &BatchOptions,
    pairs: &[Pair],
    files: &Files,
    watch: &Watch<'_>,
) -> Result<BatchOptions, Error> {
    let is_one_camera = options.alignment.is_some() || matches!(options.source, Source::Video(_));
    if options.matching.align != Align::Auto || !is_one_camera {
        return Ok(options.clone());
    }
    let file = options.alignment.as_deref().map(|path| (files, path));
    let (pixels, memory) = (options.max_megapixels, options.matching.max_memory);
    let read = |pair: &Pair| {
        let (pair, stretch) = (pair.clone(), options.matching.stretch);
        watch.unless_stopped(move || {
            let images = [pair.left.as_path(), &pair.right];
            if stretch {
                Ok(read_stretched_pair(images, None, pixels, memory)?.pair)
            } else {
                read_pair(images, pixels, memory)
            }
        })?
    };
    let align = align_camera(pairs.iter().map(read), file, watch)?;
    if let Align::Known(known) = align
        && !known.is_negligible()
    {
        let [least, largest] = known.range();
        watch.note(&format!("rows differ by {least:.2} to {largest:.2} px; corrected in all pairs"));
    }
    Ok(BatchOptions { matching: Options { align, ..options.matching.clone() }, ..options.clone() })
}

/// Matches the jobs that are due, and returns those that failed.
fn match_due(run: &Run<'_>, due: &[&Job<'_>]) -> Result<Vec<Failed>, Error> {
    if due.is_empty() {
        return Ok(Vec::new());
    }
    run.all(due).inspect_err(|error| {
        if error.cause() == Cause::Stopped {
            let again = if run.options.force { "the same command without `force`" } else { "the same command again" };
            run.watch.note(&format!("run {again} to continue with the pairs that are not complete"));
        }
    })
}

/// Fails if options contradict each other, if the format of maps is unknown, or if the name of a folder is not UTF-8, which records need.
fn check(options: &BatchOptions, making: &Making) -> Result<(), Error> {
    options.matching.check()?;
    if options.matching.stretch && making.rectifying.is_some() {
        return Err(Error::Options("`stretch` is for rectified images, without `rectify`".to_owned()));
    }
    if MapFormat::named(&options.format).is_none() {
        return Err(Error::Options(format!("format {}: a map ends in {}", options.format, MapFormat::ENDINGS)));
    }
    let folder = if let Source::Path(path) = &options.source { Some(path) } else { None };
    for folder in [Some(&options.output), folder].into_iter().flatten() {
        if std::path::absolute(folder).is_ok_and(|folder| folder.to_str().is_none()) {
            let what = "the name is not UTF-8, which the records of a batch need; rename it";
            return Err(Error::Options(format!("{}: {what}", folder.display())));
        }
    }
    check_warm_start(options)
}

/// Refuses a warm start if a frame has no messages to start from.
fn check_warm_start(options: &BatchOptions) -> Result<(), Error> {
    let matching = &options.matching;
    if options.warm_start.is_none() {
        return Ok(());
    }
    if !matches!(options.source, Source::Video(_)) {
        let what = "pairs of different scenes have nothing in common";
        return Err(Error::Options(format!("`warm_start` needs `video`: {what}")));
    }
    if matching.algorithm.is_swept() || matching.needs_right() {
        let what = "`warm_start` needs the messages of the frame before";
        let why = "the schedule sweep does not keep them, and matching both views overwrites them";
        let advice =
            "use the `algorithm` cfbp with 10 `half_steps`, say, and neither `check` (left-right) nor confidence";
        return Err(Error::Options(format!("{what}: {why}; {advice}")));
    }
    if matching.labels == Labels::Auto {
        let what = "the same labels for all frames: give `labels` a number";
        return Err(Error::Options(format!("`warm_start` needs {what}")));
    }
    Ok(())
}
