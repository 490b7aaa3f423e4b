//! `bp match --video -`: matches frames while they arrive through a pipe.

use std::{
    fmt,
    time::{Duration, Instant},
};

use bp_io::FrameFormat;
use bp_stereo::{
    Disparity,
    stream::{Stream, StreamOptions},
};

use crate::{failure::Failure, interrupt, notes::note, terminal};

/// Writes the map of each frame to standard output as soon as it is known.
pub(super) fn match_stream(options: StreamOptions, format: FrameFormat) -> Result<(), Failure> {
    interrupt::listen()?;
    let watch = terminal::watch();
    let mut stream = Stream::open(options, &watch)?;
    let mut pace = Pace::default();
    while let Some(pair) = stream.next_pair(&watch)? {
        let arrived = Instant::now();
        let answer = stream.compute(&pair, &watch).map_err(|error| error.of(format!("frame {}", pace.frames + 1)))?;
        let encoded = format.encode(&answer.map, range(&answer), stream.rate(), pace.frames == 0);
        terminal::emit(encoded.map_err(Failure::other)?)?;
        pace.add(arrived);
    }
    note(&pace.to_string());
    Ok(())
}

/// The disparities of the first and of the last label, in pixels: colours then mean the same in all frames with these labels.
fn range(answer: &Disparity) -> [f32; 2] {
    let first = answer.settings.min_disparity as f32;
    [first, first + answer.settings.labels as f32 - 1.0]
}

/// How fast frames pass.
#[derive(Debug, Default)]
struct Pace {
    frames: u32,
    begun: Option<Instant>,
    /// Since the first frame arrived.
    passed: Duration,
    /// From the arrival of a frame to the end of its map, together and at most.
    waited: Duration,
    longest: Duration,
}

impl Pace {
    fn add(&mut self, arrived: Instant) {
        let waited = arrived.elapsed();
        self.frames += 1;
        self.passed = self.begun.get_or_insert(arrived).elapsed();
        self.waited += waited;
        self.longest = self.longest.max(waited);
    }
}

impl fmt::Display for Pace {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { frames, passed, waited, longest, .. } = self;
        let (seconds, ms) = (passed.as_secs_f64(), |time: Duration| 1000.0 * time.as_secs_f64());
        let mean = ms(*waited) / f64::from((*frames).max(1));
        write!(out, "{frames} frames in {seconds:.1} s: {:.1} frames/s; ", f64::from(*frames) / seconds.max(1e-9))?;
        write!(out, "from frame to map {mean:.1} ms on average, {:.1} ms at most", ms(*longest))
    }
}
