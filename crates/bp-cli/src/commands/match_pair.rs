//! `bp match`: matches one pair or many.

use std::{
    iter,
    path::{Path, PathBuf},
};

use bp_core::{DisparityMap, GroundTruth, Size, StereoPair};
use bp_io::{MapFormat, Mask, read_mask};
use bp_stereo::{
    Align, AnswerTimes, Beside, Content, Disparity, Error, Making, Matcher, Options, Outputs, Planned, ReadPair, Start,
    align_camera, batch, read_beside, read_pair, read_raw_pair, read_stretched_pair,
};

use super::{
    evaluate,
    match_report::{Asked, Report, text},
    match_stream::match_stream,
    match_summary, print, print_json,
};
use crate::{
    args::MatchArgs,
    failure::{Failure, as_options},
    heap, interrupt, terminal,
};

/// Runs the command.
pub(crate) fn match_pair(args: &MatchArgs) -> Result<(), Failure> {
    heap::set_up(args.max_memory.is_some());
    if let Some((options, format)) = args.stream()? {
        return match_stream(options, format);
    }
    match (args.batch()?, &args.left, &args.right) {
        (None, Some(left), Some(right)) => match_one(args, [left, right]),
        (Some(options), ..) => match_many(args, &options),
        _ => Err(Failure::usage("give two images, --pairs or --video")),
    }
}

fn match_many(args: &MatchArgs, options: &batch::BatchOptions) -> Result<(), Failure> {
    let making = args.making()?;
    interrupt::listen()?;
    let summary = batch::run(options, &making, &terminal::watch());
    terminal::finish();
    let summary = summary?;
    if args.json {
        print_json(&summary)?;
    } else {
        print(&match_summary::text(&summary))?;
    }
    let path = options.shard.summary_path(&options.output);
    match (summary.failures.len(), summary.unread.len()) {
        (0, 0) => Ok(()),
        (0, folders) => Err(Failure::input(format!("{folders} folders could not be read; see {}", path.display()))),
        (failed, _) => {
            Err(Failure::input(format!("{failed} of {} pairs failed; see {}", summary.pairs, path.display())))
        }
    }
}

/// One pair: its images and its outputs.
struct Job<'a> {
    args: &'a MatchArgs,
    files: [&'a PathBuf; 2],
    pair: StereoPair,
    valid: Option<Vec<bool>>,
    truth: Option<GroundTruth>,
    outputs: Outputs,
    making: Making,
}

fn match_one(args: &MatchArgs, files: [&PathBuf; 2]) -> Result<(), Failure> {
    let (mut options, outputs, making) = (args.options()?, args.outputs(), args.making()?);
    // The report shows it.
    options.energy = true;
    let truths = [&args.ground_truth, &args.truth.ground_truth_right, &args.truth.mask].into_iter().flatten();
    let others = truths.chain(args.plan.align.file()).map(PathBuf::as_path);
    outputs.check(&making, &sources(args).chain(others).collect::<Vec<_>>())?;
    let mut read = read(args, files.map(PathBuf::as_path), &making)?;
    if outputs.points.is_none() {
        // Colours that nobody needs are freed.
        read.pair = options.compared(read.pair);
    }
    let truth = args.ground_truth.as_deref().map(|path| read_truth(args, path, &read, &options)).transpose()?;
    let ReadPair { pair, valid } = read;
    interrupt::listen()?;
    if let (Align::Auto, Some(file)) = (options.align, args.plan.align.file()) {
        options.align = align_camera(iter::once(Ok(pair.clone())), Some((&making.files, file)), &terminal::watch())?;
    }
    let whole = args.messages_hash.then_some("messages_hash");
    let beside = Beside {
        truth: truth.is_some(),
        masked: valid.is_some(),
        depth: args.outputs.depth.is_some(),
        rectified: args.rectify,
        batch: false,
        listed: 0,
        whole,
    };
    let mut matcher = Matcher::new(&options)?.beside(beside);
    let job = Job { args, files, pair, valid, truth, outputs, making };
    let report = job.run(&mut matcher)?;
    match () {
        () if args.json => print_json(&report),
        () if args.is_piped() => Ok(()),
        () => print(&text(&report)),
    }
}

impl Job<'_> {
    /// Plans and matches the pair, and writes its files.
    fn run(&self, matcher: &mut Matcher) -> Result<Report, Failure> {
        let planned = self.plan(matcher)?;
        let warnings = planned.warnings.iter().map(|warning| as_options(&warning.about(&self.name()))).collect();
        let (answer, times) = self.matched(matcher, planned)?;
        terminal::finish();
        let errors = self.truth.as_ref().map(|truth| truth.errors(&answer.map)).transpose()?;
        let messages_sha256 = self.args.messages_hash.then(|| matcher.messages_sha256()).transpose()?;
        let content = Content {
            map: &answer.map,
            confidence: answer.confidence.as_deref(),
            image: Some(self.pair.left()),
            plan: Some(&answer.settings),
            inputs: &sources(self.args).collect::<Vec<_>>(),
        };
        self.outputs.write(&self.making, &content, &terminal::watch())?;
        if self.args.is_piped() {
            pipe(&self.making, &answer.map)?;
        }
        let asked = Asked { size: self.pair.size(), warnings, errors, messages_sha256 };
        Ok(Report::new(matcher, answer, &times, asked, self.outputs.paths(&self.making)))
    }

    /// Plans the pair, and checks that its outputs can hold the result. Shows warnings before this check: exchanged
    /// images may be the reason that it fails.
    fn plan(&self, matcher: &Matcher) -> Result<Planned, Failure> {
        let planned = matcher.plan(&self.pair)?;
        planned.warnings.iter().for_each(|warning| terminal::warn(&as_options(&warning.about(&self.name()))));
        self.hint_at_scale(&planned);
        self.outputs.check_plan(&self.making, &planned.plan)?;
        Ok(planned)
    }

    /// Warns if ground truth exceeds the labels. It was then most likely stored as a multiple of disparities.
    fn hint_at_scale(&self, Planned { plan, .. }: &Planned) {
        let last = plan.model().disparity(plan.model().labels() as u16 - 1);
        let truth = self.truth.as_ref().and_then(|truth| truth.disparities().range());
        let (Some((_, largest)), Some(path)) = (truth, &self.args.ground_truth) else { return };
        if largest > last as f32 + 1.0 {
            let what = format!("disparities up to {largest:.0} px, but the labels end at {last} px");
            terminal::warn(&format!("{}: {what}; is another --scale needed?", path.display()));
        }
    }

    /// Matches the pair as often as the arguments ask for. Returns the last answer and the times of all. Only one
    /// answer is in memory at a time.
    fn matched(&self, matcher: &mut Matcher, mut planned: Planned) -> Result<(Disparity, Vec<AnswerTimes>), Error> {
        let mut times = Vec::new();
        loop {
            let mut answer = matcher.run(&self.pair, planned, Start::Cold, &terminal::watch())?;
            self.valid.iter().for_each(|valid| answer.restrict(valid));
            times.push(answer.times);
            if times.len() >= self.args.repeat as usize {
                return Ok((answer, times));
            }
            planned = matcher.plan(&self.pair)?;
        }
    }

    /// Both images, for messages.
    fn name(&self) -> String {
        let [left, right] = self.files;
        format!("{} and {}", left.display(), right.display())
    }
}

/// Reads the pair, and rectifies or stretches it if asked for.
fn read(args: &MatchArgs, files: [&Path; 2], making: &Making) -> Result<ReadPair, Failure> {
    let (megapixels, max_memory) = (args.max_megapixels, args.max_memory.map(|limit| limit.as_u64()));
    let mask_beside = |held: u64| {
        let read = |path| read_beside(held, megapixels, max_memory, |limit| read_mask(path, limit));
        args.valid.as_deref().map(|path| Ok::<_, Error>((path, read(path)?))).transpose()
    };
    let check = |pair: &StereoPair, (path, mask): &(&Path, Mask)| check_size(path, mask.size, pair);
    if args.stretch {
        let mask = mask_beside(0)?;
        let valid = mask.as_ref().map(|(_, mask)| mask.values.as_slice());
        let read = read_stretched_pair(files, valid, megapixels, max_memory)?;
        mask.iter().try_for_each(|mask| check(&read.pair, mask))?;
        return Ok(read);
    }
    let pair = match &making.rectifying {
        Some(rectifying) => read_raw_pair(files, rectifying, megapixels, max_memory)?,
        None => read_pair(files, megapixels, max_memory)?,
    };
    let mask = mask_beside(pair.bytes())?;
    mask.iter().try_for_each(|mask| check(&pair, mask))?;
    Ok(ReadPair { pair, valid: mask.map(|(_, mask)| mask.values) })
}

/// Writes a map to standard output.
fn pipe(making: &Making, map: &DisparityMap) -> Result<(), Failure> {
    let bytes = making.raster(map).floats(MapFormat::Pfm).unwrap_or_else(|| Ok(Vec::new()));
    terminal::emit(bytes.map_err(Failure::other)?)
}

/// The files that the outputs are made from.
fn sources(args: &MatchArgs) -> impl Iterator<Item = &Path> {
    [&args.left, &args.right, &args.valid].into_iter().flatten().chain(args.outputs.calibration()).map(PathBuf::as_path)
}

fn read_truth(
    args: &MatchArgs,
    path: &Path,
    ReadPair { pair, valid }: &ReadPair,
    options: &Options,
) -> Result<GroundTruth, Failure> {
    let held = pair.bytes() + valid.as_ref().map_or(0, |valid| valid.len() as u64);
    let read = |limit| evaluate::read_truth(path, &args.truth, limit);
    let truth = read_beside(held, args.max_megapixels, options.max_memory, read)?;
    check_size(path, truth.disparities().size(), pair)?;
    Ok(truth)
}

/// Refuses a file whose size is not that of the images.
fn check_size(path: &Path, found: Size, pair: &StereoPair) -> Result<(), Failure> {
    let size = pair.size();
    if found == size {
        return Ok(());
    }
    Err(Failure::input(format!("{}: {found} pixels, but the images have {size}", path.display())))
}
