//! Makes the plan of a pair from options.

use bp_core::{
    Alignment, Around, Image, MAX_LABELS, Model, Plan, Size, StereoPair, Tiling,
    survey::{DisparityRange, Survey},
};

use crate::{Align, Error, Labels, Options, algorithm::Derived, description, devices::Opened};

/// The plan for a pair with these labels.
pub(crate) fn plan(options: &Options, pair: &StereoPair, range: DisparityRange) -> Result<Plan, Error> {
    let size = pair.size();
    let model = Model::new(options.profile_for(pair), range.labels)?.with_min_disparity(range.min_disparity)?;
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

/// The labels that the options ask for. `None` if [`Labels::Auto`] finds none; the caller then uses [`quarter_of_width`].
pub(crate) fn labels(options: &Options, size: Size, survey: &Survey) -> Option<DisparityRange> {
    let min_disparity = options.min_disparity.unwrap_or(0);
    match options.labels {
        Labels::Count(labels) => Some(DisparityRange { min_disparity, labels }),
        Labels::QuarterOfWidth => Some(quarter_of_width(options, size)),
        Labels::Auto => {
            let range = survey.seen?.range();
            Some(options.min_disparity.map_or(range, |first| range.starting_at(first)))
        }
    }
}

/// The alignment that the options ask for; `None` if they do not, or if too few points agree.
pub(crate) fn alignment(options: &Options, pair: &StereoPair, survey: &Survey) -> Result<Option<Alignment>, Error> {
    match options.align {
        Align::Off => Ok(None),
        Align::Auto => Ok(Alignment::find(pair, survey)),
        Align::Known(known) if known.size() == pair.size() => Ok(Some(known)),
        Align::Known(known) => {
            let (known, size) = (known.size(), pair.size());
            Err(Error::Options(format!("`align` is for images of {known} pixels, but these have {size}")))
        }
    }
}

/// See [`Labels::QuarterOfWidth`].
pub(crate) fn quarter_of_width(options: &Options, size: Size) -> DisparityRange {
    let usual_width = (size.pixels() * 4).div_ceil(3).isqrt().min(size.width);
    let labels = usual_width.div_ceil(4).next_multiple_of(16).min(MAX_LABELS);
    DisparityRange { min_disparity: options.min_disparity.unwrap_or(0), labels }
}

/// What blocks of a larger image need around them, to be matched one by one as the library matches tiles; `None` if the
/// algorithm needs the whole image. Neighbouring blocks are then joined along a [`bp_core::border`].
///
/// # Errors
/// [`Error::Options`] if [`Options::labels`] is not a number, or options contradict each other.
pub fn around(options: &Options) -> Result<Option<Around>, Error> {
    /// A size on which every plan can run.
    const SIDE: usize = 256;
    options.check()?;
    let Labels::Count(labels) = options.labels else {
        return Err(Error::Options(
            "`labels` must be a number: each block by itself would find other labels".to_owned(),
        ));
    };
    let blank = Image::from_grey(SIDE, SIDE, vec![0; SIDE * SIDE])?;
    let range = DisparityRange { min_disparity: options.min_disparity.unwrap_or(0), labels };
    let plan = plan(options, &StereoPair::new(blank.clone(), blank)?, range)?;
    // A cut goes through the middle of the image, and each block would have its own.
    Ok(Around::of(&plan).filter(|_| plan.settings().cut.is_none()))
}

/// Describes a tiled plan.
pub(crate) fn described(
    options: &Options,
    tiling: &Tiling,
    alignment: Option<&Alignment>,
    opened: &Opened,
) -> Result<description::Settings, Error> {
    let (plan, device) = (tiling.plan(), opened.device.as_ref());
    let Derived { k, z } = options.algorithm.derived(plan.model().labels());
    Ok(description::Settings {
        k,
        z,
        message_updates: tiling.message_updates(),
        planned_bytes: Some(tiling.bytes(&|plan| Ok(device.planned_bytes(plan)))?),
        stretched: options.stretch,
        rows: alignment.map(Into::into),
        finish: description::Finish::of(options.finish()),
        ..description::Settings::new(plan, Some(device), options.algorithm.kind())
    })
}
