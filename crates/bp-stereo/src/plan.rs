//! Makes the plan of a pair from options.

use bp_core::{
    MAX_LABELS, Model, Plan, Size, Tiling,
    survey::{DisparityRange, SeenDisparities, Survey},
};

use crate::{Error, Labels, Options, algorithm::Derived, description, devices::Opened};

/// The plan for images of this size with these labels.
pub(crate) fn plan(options: &Options, size: Size, range: DisparityRange) -> Result<Plan, Error> {
    let model = Model::new(options.profile, range.labels)?.with_min_disparity(range.min_disparity)?;
    Ok(Plan::new(size, with_edges(options, model)?, options.algorithm.settings(size, range.labels))?)
}

/// The model with the smoothness costs that the options ask for.
fn with_edges(options: &Options, model: Model) -> Result<Model, Error> {
    let Options { slope, truncation, edge_threshold, .. } = *options;
    let model = match (slope, truncation) {
        (None, None) => model,
        _ => model.with_smoothness(slope.unwrap_or(model.slope()), truncation.unwrap_or(model.truncation()))?,
    };
    Ok(edge_threshold.map_or(model, |threshold| model.with_edges_halved_above(threshold)))
}

/// The labels that the options ask for. `hold` says whether the outputs can hold a first disparity. `None` if
/// [`Labels::Auto`] finds none; the caller then uses [`quarter_of_width`].
pub(crate) fn labels(
    options: &Options,
    size: Size,
    survey: &Survey,
    hold: &dyn Fn(i32) -> bool,
) -> Option<DisparityRange> {
    let min_disparity = options.min_disparity.unwrap_or(0);
    match options.labels {
        Labels::Count(labels) => Some(DisparityRange { min_disparity, labels }),
        Labels::QuarterOfWidth => Some(quarter_of_width(options, size)),
        Labels::Auto => {
            let seen = survey.seen?;
            Some(seen.range().starting_at(options.min_disparity.unwrap_or_else(|| first(seen, hold))))
        }
    }
}

/// See [`Labels::QuarterOfWidth`].
pub(crate) fn quarter_of_width(options: &Options, size: Size) -> DisparityRange {
    let labels = size.width.div_ceil(4).next_multiple_of(16).min(MAX_LABELS);
    DisparityRange { min_disparity: options.min_disparity.unwrap_or(0), labels }
}

/// The first disparity. It is 0 if only the margin is negative and the outputs cannot hold negative disparities.
fn first(seen: SeenDisparities, hold: &dyn Fn(i32) -> bool) -> i32 {
    let first = seen.range().min_disparity;
    if first < 0 && seen.least >= -seen.step && !hold(first) { 0 } else { first }
}

/// Describes a tiled plan.
pub(crate) fn described(options: &Options, tiling: &Tiling, opened: &Opened) -> Result<description::Settings, Error> {
    let (plan, device) = (tiling.plan(), opened.device.as_ref());
    let Derived { k, z } = options.algorithm.derived(plan.model().labels());
    Ok(description::Settings {
        k,
        z,
        message_updates: tiling.message_updates(),
        planned_bytes: tiling.bytes(&|plan| Ok(device.planned_bytes(plan)))?,
        finish: description::Finish::of(options.finish()),
        ..description::Settings::new(plan, Some(device), options.algorithm.kind())
    })
}
