//! The labels that a pair is matched with.

use bp_core::{
    MAX_LABELS, Size,
    survey::{DisparityRange, SeenDisparities, Survey},
};

use super::Outputs;
use crate::args::{Labels, PlanArgs};

/// The labels that the options ask for. `None` where auto finds none: the default is [`default`].
pub(crate) fn range(args: &PlanArgs, size: Size, survey: &Survey, outputs: &Outputs) -> Option<DisparityRange> {
    let min_disparity = args.min_disparity.unwrap_or(0);
    match (args.labels, survey.seen) {
        (Some(Labels::Count(count)), _) => Some(DisparityRange { min_disparity, labels: count.into() }),
        (None, _) => Some(default(args, size)),
        (Some(Labels::Auto), None) => None,
        (Some(Labels::Auto), Some(seen)) => {
            Some(seen.range().starting_at(args.min_disparity.unwrap_or_else(|| first(seen, outputs))))
        }
    }
}

/// A quarter of the width, as OpenCV recommends for belief propagation, rounded up to a multiple of 16.
pub(crate) fn default(args: &PlanArgs, size: Size) -> DisparityRange {
    let labels = size.width.div_ceil(4).next_multiple_of(16).min(MAX_LABELS);
    DisparityRange { min_disparity: args.min_disparity.unwrap_or(0), labels }
}

/// The first disparity: 0 where nothing but the margin is negative and the outputs hold no negative ones.
fn first(seen: SeenDisparities, outputs: &Outputs) -> i32 {
    let first = seen.range().min_disparity;
    if first < 0 && seen.least >= -seen.step && !outputs.hold(first) { 0 } else { first }
}
