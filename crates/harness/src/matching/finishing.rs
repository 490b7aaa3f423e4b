//! From both views of a pair to the map that is written.

use std::time::{Duration, Instant};

use bp_core::{
    DisparityMap, Error, StereoPair, Times,
    finish::{self, Finish},
};

use crate::args::FinishArgs;

/// What one answer took, by the wall clock.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    /// Matching the left image, and the right one where that was needed.
    pub(crate) matching: Times,
    /// All that came after, and turning the pair for the right image.
    pub(crate) finishing: Duration,
}

impl Sample {
    /// From images in memory to the map.
    pub(crate) fn total(&self) -> Duration {
        self.matching.total + self.finishing
    }
}

/// A map that is done.
pub(super) struct Finished {
    pub(super) map: DisparityMap,
    /// See [`finish::confidence`], 0 where the check or speckles made the disparity unknown; where it was asked for.
    pub(super) confidence: Option<Vec<f32>>,
    pub(super) sample: Sample,
}

/// Matches what has to be matched, by `solve`, and finishes the left image's map. That one is matched last, so that its
/// labels and messages are there afterwards.
pub(super) fn finished<E: From<Error>>(
    args: &FinishArgs,
    pair: &StereoPair,
    mut solve: impl FnMut(&StereoPair) -> Result<(Times, DisparityMap), E>,
) -> Result<Finished, E> {
    let start = Instant::now();
    let mut matching = Times::default();
    let mut matched = |pair: &StereoPair| {
        let (times, map) = solve(pair)?;
        matching += times;
        Ok::<_, E>(map)
    };
    let right = args.needs_right().then(|| matched(&pair.mirrored())).transpose()?.map(DisparityMap::mirrored);
    let left = matched(pair)?;
    let trust = right.as_ref().filter(|_| args.confidence.is_some());
    let mut confidence = trust.map(|right| finish::confidence(&left, right)).transpose()?;
    let finish: Finish = args.finish();
    let judge = Finish { fill: false, median: None, subpixel: false, ..finish };
    let judged = judge.apply(left, right.as_ref())?;
    for (trust, _) in confidence.iter_mut().flatten().zip(judged.values()).filter(|(_, value)| !value.is_finite()) {
        *trust = 0.0;
    }
    let map = Finish { check: false, speckles: None, ..finish }.apply(judged, None)?;
    Ok(Finished { map, confidence, sample: Sample { matching, finishing: start.elapsed() - matching.total } })
}
