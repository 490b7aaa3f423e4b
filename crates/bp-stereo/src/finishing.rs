//! Matches one or both views of a pair and finishes the map.

use std::time::{Duration, Instant};

use bp_core::{
    DisparityMap, IsStopped, StereoPair, Times,
    finish::{self, Finish},
};

use crate::{Error, Options};

/// Wall-clock times of one answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AnswerTimes {
    /// Surveying the pair, aligning its rows and making its plan.
    pub planning: Duration,
    /// Matching the left image, and the right one if needed.
    pub matching: Times,
    /// Everything else: mirroring the pair for the right image, and finishing the map.
    pub finishing: Duration,
}

impl AnswerTimes {
    /// Time from images in memory to the finished map.
    #[must_use]
    pub fn total(&self) -> Duration {
        self.planning + self.matching.total + self.finishing
    }
}

/// A finished map.
pub(crate) struct Finished {
    pub(crate) map: DisparityMap,
    /// See [`finish::confidence`]; [`finish::FILLED`] where the disparity was filled, and 0 where it is unknown. `None` unless the
    /// options ask for it.
    pub(crate) confidence: Option<Vec<f32>>,
    pub(crate) times: AnswerTimes,
}

/// The image that a map belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum View {
    Left,
    /// Matched as the left image of the mirrored pair.
    Right,
}

/// Matches the left image with `solve`, and the right one if needed. Then finishes the left image's map. The left image
/// is matched last, so that its labels and messages remain available.
pub(crate) fn finished(
    options: &Options,
    pair: &StereoPair,
    is_stopped: IsStopped<'_>,
    mut solve: impl FnMut(&StereoPair, View) -> Result<(Times, DisparityMap), Error>,
) -> Result<Finished, Error> {
    let start = Instant::now();
    let mut matching = Times::default();
    let mut matched = |pair: &StereoPair, view| -> Result<DisparityMap, Error> {
        let (times, map) = solve(pair, view)?;
        matching += times;
        Ok(map)
    };
    let right = options.needs_right().then(|| matched(&pair.mirrored(), View::Right)).transpose()?;
    let right = right.map(DisparityMap::mirrored);
    let left = matched(pair, View::Left)?;
    let trust = right.as_ref().filter(|_| options.confidence);
    let mut confidence = trust.map(|right| finish::confidence(&left, right, is_stopped)).transpose()?;
    let finish: Finish = options.finish();
    let judged = finish.judge(pair, left, right.as_ref(), is_stopped)?;
    let mut trust_unknown = |map: &DisparityMap, to: f32| {
        let pixels = confidence.iter_mut().flatten().zip(map.values());
        pixels.filter(|(_, value)| !value.is_finite()).for_each(|(trust, _)| *trust = to);
    };
    trust_unknown(&judged, finish::FILLED);
    let map = finish.complete(judged, is_stopped)?;
    trust_unknown(&map, 0.0);
    Ok(Finished {
        map,
        confidence,
        times: AnswerTimes { planning: Duration::ZERO, matching, finishing: start.elapsed() - matching.total },
    })
}
