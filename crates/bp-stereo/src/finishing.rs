//! From both views of a pair to the finished map.

use std::time::{Duration, Instant};

use bp_core::{
    DisparityMap, StereoPair, Times,
    finish::{self, Finish},
};

use crate::{Error, Options};

/// What one answer took, by the wall clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AnswerTimes {
    /// Matching the left image, and the right one where that was needed.
    pub matching: Times,
    /// Everything after that, and mirroring the pair for the right image.
    pub finishing: Duration,
}

impl AnswerTimes {
    /// From images in memory to the map.
    #[must_use]
    pub fn total(&self) -> Duration {
        self.matching.total + self.finishing
    }
}

/// A finished map.
pub(crate) struct Finished {
    pub(crate) map: DisparityMap,
    /// See [`finish::confidence`]; 0 where the check or the speckle filter made the disparity unknown. None unless asked for.
    pub(crate) confidence: Option<Vec<f32>>,
    pub(crate) times: AnswerTimes,
}

/// Matches what has to be matched, by `solve`, and finishes the left image's map. The left image comes last, so that its
/// labels and messages are there afterwards.
pub(crate) fn finished(
    options: &Options,
    pair: &StereoPair,
    mut solve: impl FnMut(&StereoPair) -> Result<(Times, DisparityMap), Error>,
) -> Result<Finished, Error> {
    let start = Instant::now();
    let mut matching = Times::default();
    let mut matched = |pair: &StereoPair| -> Result<DisparityMap, Error> {
        let (times, map) = solve(pair)?;
        matching += times;
        Ok(map)
    };
    let right = options.needs_right().then(|| matched(&pair.mirrored())).transpose()?.map(DisparityMap::mirrored);
    let left = matched(pair)?;
    let trust = right.as_ref().filter(|_| options.confidence);
    let mut confidence = trust.map(|right| finish::confidence(&left, right)).transpose()?;
    let finish: Finish = options.finish();
    let judge = Finish { fill: false, median: None, subpixel: false, ..finish };
    let judged = judge.apply(left, right.as_ref())?;
    for (trust, _) in confidence.iter_mut().flatten().zip(judged.values()).filter(|(_, value)| !value.is_finite()) {
        *trust = 0.0;
    }
    let map = Finish { check: false, speckles: None, ..finish }.apply(judged, None)?;
    Ok(Finished { map, confidence, times: AnswerTimes { matching, finishing: start.elapsed() - matching.total } })
}
