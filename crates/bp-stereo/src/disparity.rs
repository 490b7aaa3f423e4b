//! The disparities of a pair, and what is known of them.

use std::time::Duration;

use bp_core::{DisparityMap, Energy};

use crate::{AnswerTimes, Tiles, Warning, description};

/// The answer for a pair.
#[derive(Clone, Debug)]
pub struct Disparity {
    /// The disparity map of the left image.
    pub map: DisparityMap,
    /// The confidence of each pixel, 0 to 1, `[height][width]`: [`bp_core::finish::FILLED`] where the disparity was filled, and 0 where it
    /// is unknown. `None` unless [`Options::confidence`](crate::Options::confidence) asks for it.
    pub confidence: Option<Vec<f32>>,
    /// Wall-clock times.
    pub times: AnswerTimes,
    /// The energy of the labels; `None` unless [`Options::energy`](crate::Options::energy) asks for it.
    pub energy: Option<Energy>,
    /// The settings that were run.
    pub settings: description::Settings,
    /// The tiles; `None` if the pair was matched as a whole.
    pub tiles: Option<Tiles>,
    /// The message entries that were computed for one image. With label sets, fewer than [`Self::settings`] predict.
    pub message_updates: u64,
    /// Bytes that the device allocated for the plan.
    pub allocated_bytes: u64,
    /// Predicted peak memory of the program, in bytes.
    pub peak_bytes: u64,
    /// Possible problems with the pair or its labels.
    pub warnings: Vec<Warning>,
}

impl Disparity {
    /// Makes the pixels unknown that are not valid, `[height][width]`, and their confidence 0.
    ///
    /// # Panics
    /// If `valid` does not hold one value per pixel.
    pub fn restrict(&mut self, valid: &[bool]) {
        self.map.restrict(valid);
        for (trust, _) in self.confidence.iter_mut().flatten().zip(valid).filter(|(_, valid)| !**valid) {
            *trust = 0.0;
        }
    }
}

impl From<&Disparity> for description::Answer {
    fn from(answer: &Disparity) -> Self {
        let seconds = |time: Duration| time.as_secs_f64();
        let AnswerTimes { planning, matching, finishing } = answer.times;
        Self {
            times: description::Seconds {
                planning: seconds(planning),
                matching: seconds(matching.total),
                finishing: seconds(finishing),
                total: seconds(answer.times.total()),
            },
            energy: answer.energy.map(Into::into),
            settings: answer.settings.clone(),
            warnings: answer.warnings.iter().map(ToString::to_string).collect(),
        }
    }
}
