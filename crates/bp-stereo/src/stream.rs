//! Matches the frames of a video while they arrive through a pipe.

use std::{
    collections::BTreeSet,
    fs::File,
    io::{self, Read},
    path::{Path, PathBuf},
    sync::Arc,
};

use bp_core::{Alignment, StereoPair};
use bp_io::{Files, Frames, Layout, PairFrames};

use crate::{
    Align, Beside, Disparity, Error, Event, Matcher, Options, Rectifying, Start, Watch, alignment::not_aligned,
    reading::Room,
};

/// How many frames may show how rows differ.
const ALIGNING: usize = 10;

/// The files or pipes that frames come from, as YUV4MPEG2; `-` is standard input.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StreamSource {
    /// Frames that hold both images.
    Joined(PathBuf, Layout),
    /// The left frames and the right ones.
    Separate([PathBuf; 2]),
}

/// A video that arrives frame by frame.
#[derive(Clone, Debug)]
pub struct StreamOptions {
    /// Where frames come from.
    pub source: StreamSource,
    /// How each frame is matched. [`Align::Auto`] is measured on the first frame on which enough points agree, among the first ten.
    pub matching: Options,
    /// The file of the camera's alignment, which is written once it is measured.
    pub alignment: Option<PathBuf>,
    /// Rectifies the frames before they are matched.
    pub rectifying: Option<Arc<Rectifying>>,
    /// Most megapixels of an image.
    pub max_megapixels: u32,
}

/// Matches one frame after another.
#[derive(Debug)]
pub struct Stream {
    options: StreamOptions,
    matcher: Matcher,
    frames: Option<PairFrames>,
    /// Frames per second, as a fraction.
    rate: [usize; 2],
    /// Frames matched.
    count: usize,
    /// Warnings that were given.
    warned: BTreeSet<&'static str>,
}

impl Stream {
    /// Opens the device and then the source, which may wait for the program that writes to it.
    ///
    /// # Errors
    /// [`Error::Options`], [`Error::File`] if the source is no such video, [`Error::Stopped`], and those of [`Matcher::new`].
    pub fn open(options: StreamOptions, watch: &Watch<'_>) -> Result<Self, Error> {
        if options.matching.stretch {
            return Err(Error::Options("`stretch` is for files: frames have 8 bits".to_owned()));
        }
        let beside = Beside { rectified: options.rectifying.is_some(), batch: true, ..Beside::default() };
        let matcher = Matcher::new(&options.matching)?.beside(beside);
        let (source, room) = (options.source.clone(), Room::new(options.max_megapixels, options.matching.max_memory));
        let frames = watch.unless_stopped(move || source.frames(room))??;
        let rate = frames.rate();
        Ok(Self { options, matcher, frames: Some(frames), rate, count: 0, warned: BTreeSet::new() })
    }

    /// Frames per second that the source announces, as a fraction.
    #[must_use]
    pub fn rate(&self) -> [usize; 2] {
        self.rate
    }

    /// Waits for the next pair; `None` at the end of the source.
    ///
    /// # Errors
    /// [`Error::File`] if the source ends within a frame, [`Error::Stopped`], and those of rectifying.
    pub fn next_pair(&mut self, watch: &Watch<'_>) -> Result<Option<StereoPair>, Error> {
        let Some(mut frames) = self.frames.take() else { return Ok(None) };
        let (frames, pair) = watch.unless_stopped(move || {
            let pair = frames.next_pair();
            (frames, pair)
        })?;
        let Some(pair) = pair? else { return Ok(None) };
        self.frames = Some(frames);
        match &self.options.rectifying {
            Some(rectifying) => rectifying.rectified(&pair).map(Some),
            None => Ok(Some(pair)),
        }
    }

    /// Matches a pair. Each kind of warning is told once.
    ///
    /// # Errors
    /// Those of [`Matcher::plan`] and [`Matcher::run`].
    pub fn compute(&mut self, pair: &StereoPair, watch: &Watch<'_>) -> Result<Disparity, Error> {
        self.count += 1;
        let planned = self.matcher.plan(pair)?;
        self.keep(planned.alignment, watch)?;
        for warning in planned.warnings.iter().filter(|warning| self.warned.insert(warning.of_many())) {
            watch.warn(&warning.about(&format!("the images of frame {}", self.count)));
        }
        // The caller counts frames, not the work within one.
        let events = |event: Event<'_>| {
            if !matches!(event, Event::Progress { .. }) {
                watch.tell(event);
            }
        };
        self.matcher.run(pair, planned, Start::Cold, &watch.with_events(&events))
    }

    /// Keeps the alignment of the first frame that has one, for all others.
    fn keep(&mut self, found: Option<Alignment>, watch: &Watch<'_>) -> Result<(), Error> {
        if self.matcher.options().align != Align::Auto {
            return Ok(());
        }
        let file = self.options.alignment.as_deref();
        match (found, file) {
            (Some(alignment), Some(path)) => Files::default().json(path, &alignment)?,
            (None, _) if self.count < ALIGNING => return Ok(()),
            (None, Some(path)) => watch.warn(&not_aligned(path)),
            (_, None) => {}
        }
        self.matcher.align(found.map_or(Align::Off, Align::Known));
        Ok(())
    }
}

impl StreamSource {
    /// Opens the source.
    fn frames(&self, room: Room) -> Result<PairFrames, Error> {
        let frames = |path: &Path| -> Result<Frames, Error> {
            let failed = |error: io::Error| bp_io::Error::Read { path: path.to_owned(), reason: error.to_string() };
            let (reader, name): (Box<dyn Read + Send>, _) = if path == Path::new("-") {
                (Box::new(io::stdin()), Path::new("standard input"))
            } else {
                (Box::new(File::open(path).map_err(failed)?), path)
            };
            room.explained(Frames::new(reader, name, room.limits))
        };
        match self {
            Self::Joined(path, layout) => Ok(PairFrames::Joined(Box::new(frames(path)?), *layout)),
            Self::Separate([left, right]) => Ok(PairFrames::Separate(Box::new([frames(left)?, frames(right)?]))),
        }
    }
}
