//! What may be wrong with a pair or its labels, told before it is matched.

use std::path::Path;

use bp_core::{
    Plan,
    survey::{RowOffsets, SeenDisparities, Survey},
};

/// All warnings: what a coarse look at the two files says about them and the plan, and labels that match nothing.
pub(crate) fn of(survey: &Survey, plan: &Plan, [left, right]: [&Path; 2], range_missing: bool) -> Vec<String> {
    let pair = format!("{} and {}", left.display(), right.display());
    let first = plan.model().min_disparity();
    let mut warnings = Vec::new();
    if survey.unlike {
        warnings.push(format!(
            "hardly anything in {pair} matches: they show different scenes, are far from rectified, or are blank"
        ));
    }
    if range_missing {
        warnings.push(format!("--labels auto: too little in {pair} matches, the default is taken"));
    }
    if survey.exchanged {
        warnings.push(format!(
            "{pair} look exchanged: give them the other way round, or a negative --min-disparity if that is meant"
        ));
    }
    warnings.extend(survey.rows.map(|rows| apart(&pair, rows)));
    // What was seen of other pairs is not to be relied on, or would be told twice.
    let trusted = survey.rows.is_none() && !(survey.exchanged && first >= 0);
    warnings.extend(survey.seen.filter(|_| trusted).and_then(|seen| beyond(&pair, seen, plan)));
    warnings.extend(unused(plan));
    warnings
}

fn apart(pair: &str, rows: RowOffsets) -> String {
    let RowOffsets { whole, left, right, top, bottom } = rows;
    let parts = [left, right, top, bottom];
    let how = if whole != 0 && parts.iter().all(|&part| part == whole) {
        format!("the second lies {whole} px too low")
    } else {
        format!(
            "the second lies {left} px too low at the left, {right} at the right, {top} at the top, {bottom} at the bottom"
        )
    };
    format!("rows of {pair} do not correspond ({how}): rectify them first")
}

fn beyond(pair: &str, seen: SeenDisparities, plan: &Plan) -> Option<String> {
    let model = plan.model();
    let (first, last) = (model.min_disparity(), model.disparity(model.labels() as u16 - 1));
    let advice = match seen.beyond(model) {
        [false, false] => return None,
        [true, false] => "lower --min-disparity",
        [false, true] => "raise --labels",
        [true, true] => "lower --min-disparity and raise --labels",
    };
    let (least, largest) = (seen.least, seen.largest);
    Some(format!(
        "{pair} have disparities from about {least} to {largest} px, the labels reach from {first} to {last}: {advice}, \
         or take --labels auto"
    ))
}

/// Labels that match nothing inside the right image.
fn unused(plan: &Plan) -> Option<String> {
    let (model, width) = (plan.model(), plan.image_size().width);
    let matches_any = |label| (model.disparity(label).unsigned_abs() as usize) < width;
    if !(0..model.labels() as u16).any(matches_any) {
        return Some("with this --min-disparity no label matches anything inside the right image".to_owned());
    }
    let labels = model.labels();
    (labels > width).then(|| format!("{labels} labels for images {width} pixels wide: the last ones match nowhere"))
}
