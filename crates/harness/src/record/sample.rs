//! One timed solve. Every experiment records its times in this form.

use bp_core::{Schedule, Stage, Times};
use bp_stereo::description::{Clock, Clocked, Stages, clocks, milliseconds};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::statistics::{Spread, median};

/// One timed solve.
// A turn of several short solves keeps the median of each time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sample {
    /// The round that it belongs to, from 0.
    pub round: u32,
    /// Wall-clock milliseconds to allocate, not part of the total.
    // Every sample of `bp reproduce` prepares anew, so its schema requires this. The other experiments prepare once and
    // record that time elsewhere.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(required)]
    pub prepare_ms: Option<f64>,
    /// The part of these spent compiling kernels, if the device compiles any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("default" = null))]
    pub compile_ms: Option<f64>,
    /// Wall-clock milliseconds from images to labels.
    pub total_ms: f64,
    /// Milliseconds of each stage, first by the wall clock, then by the device's own if it has one.
    pub clocks: Vec<Clocked>,
}

impl Sample {
    /// The times of a solve.
    pub fn new(round: u32, times: &Times) -> Self {
        Self { round, total_ms: milliseconds(times.total), clocks: clocks(times), ..Self::default() }
    }

    /// The median of each time over samples of one turn, which have the same clocks.
    pub fn median(samples: &[Self]) -> Option<Self> {
        let first = samples.first()?;
        let of = |ms: &dyn Fn(&Self) -> f64| median(samples.iter().map(ms)).unwrap_or(f64::NAN);
        let clocked = |(index, clocked): (usize, &Clocked)| {
            let stage = |stage| of(&|sample| sample.clocks[index].stages.in_order()[stage]);
            Clocked { clock: clocked.clock, stages: Stages::new(std::array::from_fn(stage)) }
        };
        Some(Self {
            total_ms: of(&|sample| sample.total_ms),
            clocks: first.clocks.iter().enumerate().map(clocked).collect(),
            ..first.clone()
        })
    }

    /// The ratio of `over` to `of` in each round that both have, in which they ran under the same conditions.
    pub fn ratios(over: &[Self], of: &[Self], ms: impl Fn(&Self) -> f64) -> Vec<f64> {
        let in_round = |of: &Self| Some(ms(over.iter().find(|over| over.round == of.round)?) / ms(of));
        of.iter().filter_map(in_round).collect()
    }

    /// The median and range of a time; `None` if there are no samples.
    pub fn spread(samples: &[Self], ms: impl Fn(&Self) -> f64) -> Option<Spread> {
        Spread::of(samples.iter().map(ms))
    }

    /// Milliseconds of message passing (`refine` and `update_messages`), by the device's clock if it has one.
    #[must_use]
    pub fn message_passing_ms(&self) -> f64 {
        self.clocks.last().map_or(0.0, |clocked| clocked.stages.refine_ms + clocked.stages.update_messages_ms)
    }

    /// Milliseconds of each stage, by the device's clock if it has one.
    pub fn stages_ms(&self) -> [f64; Stage::ALL.len()] {
        self.clocks.last().map_or([0.0; 5], |clocked| clocked.stages.in_order())
    }

    /// Milliseconds of a stage. Under the schedule `sweep`, message passing includes `refine`: some backends prepare seams there,
    /// which counts as message updates.
    pub fn kernel_ms(&self, stage: Stage, schedule: &str) -> f64 {
        let stages = self.stages_ms();
        let with_seams = stage == Stage::UpdateMessages && schedule == Schedule::Sweep.name();
        stages[stage as usize] + if with_seams { stages[Stage::Refine as usize] } else { 0.0 }
    }

    /// Milliseconds of all stages by the device's clock, if it has one.
    pub fn device_ms(&self) -> Option<f64> {
        let device = self.clocks.iter().find(|clocked| clocked.clock == Clock::Device);
        device.map(|clocked| clocked.stages.in_order().iter().sum())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_of_several_solves_has_the_median_of_each_time() {
        let sample = |ms: f64| Sample {
            round: 3,
            total_ms: ms,
            clocks: vec![Clocked { clock: Clock::Wall, stages: Stages::new([10.0 - ms, 0.0, 0.0, ms, 1.0]) }],
            ..Sample::default()
        };
        let median = Sample::median(&[1.0, 9.0, 2.0].map(sample)).unwrap();
        assert_eq!((median.round, median.total_ms, median.stages_ms()), (3, 2.0, [8.0, 0.0, 0.0, 2.0, 1.0]));
        assert_eq!(Sample::median(&[]), None);
    }
}
