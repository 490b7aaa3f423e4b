//! What may be wrong with a pair or its labels, told before it is matched.

use std::path::Path;

use bp_core::{
    Plan,
    survey::{RowOffsets, SeenDisparities, Survey},
};

use crate::args::{Labels, PlanArgs};

/// All warnings: what a coarse look at the two files says about them and the plan, and labels that match nothing.
pub(crate) fn of(
    args: &PlanArgs,
    survey: &Survey,
    plan: &Plan,
    [left, right]: [&Path; 2],
    range_missing: bool,
) -> Vec<String> {
    let pair = format!("{} and {}", left.display(), right.display());
    // Who asks for negative disparities means them.
    let exchanged = survey.exchanged && args.min_disparity.is_none_or(|first| first >= 0);
    let mut warnings = Vec::new();
    if survey.identical {
        warnings.push(format!("{pair} are the same image: nothing is nearer or farther in it"));
    }
    if survey.unlike {
        warnings.push(format!(
            "hardly anything in {pair} matches: they show different scenes, are far from rectified, or are blank"
        ));
    }
    if range_missing {
        warnings.push(format!("--labels auto: too little in {pair} matches, the default is taken"));
    }
    if exchanged {
        warnings.push(format!(
            "{pair} look exchanged: give them the other way round, or a negative --min-disparity if that is meant"
        ));
    }
    warnings.extend(survey.rows.map(|rows| apart(&pair, rows)));
    // What was seen of other pairs is not to be relied on, or would be told twice.
    let trusted = survey.rows.is_none() && !exchanged;
    warnings.extend(survey.seen.filter(|_| trusted).and_then(|seen| beyond(args, &pair, seen, plan)));
    warnings.extend(unused(plan));
    warnings
}

fn apart(pair: &str, rows: RowOffsets) -> String {
    let RowOffsets { whole, left, right, top, bottom } = rows;
    let parts = [left, right, top, bottom];
    let off = |rows: i32| format!("{} px too {}", rows.abs(), if rows < 0 { "high" } else { "low" });
    let how = if whole != 0 && parts.iter().all(|&part| part == whole) {
        format!("the second lies {}", off(whole))
    } else {
        let [left, right, top, bottom] = parts.map(off);
        format!("the second lies {left} at the left, {right} at the right, {top} at the top, {bottom} at the bottom")
    };
    format!("rows of {pair} do not correspond ({how}): rectify them first")
}

fn beyond(args: &PlanArgs, pair: &str, seen: SeenDisparities, plan: &Plan) -> Option<String> {
    let model = plan.model();
    let (first, last) = (model.min_disparity(), model.disparity(model.labels() as u16 - 1));
    let (least, largest) = (seen.least, seen.largest);
    let advice = match seen.beyond(model) {
        [false, false] => return None,
        [true, _] if first > largest => "lower --min-disparity",
        [_, true] if last < least && args.min_disparity.is_some() => "raise --min-disparity",
        [true, false] => "lower --min-disparity",
        [false, true] => "raise --labels",
        [true, true] => "lower --min-disparity and raise --labels",
    };
    let auto = match (args.labels, args.min_disparity) {
        (Some(Labels::Auto), None) => "",
        (Some(Labels::Auto), Some(_)) => ", or leave it to --labels auto",
        _ => ", or take --labels auto",
    };
    Some(format!(
        "{pair} have disparities from about {least} to {largest} px, the labels reach from {first} to {last}: {advice}{auto}"
    ))
}

/// Labels that match nothing inside the right image.
fn unused(plan: &Plan) -> Option<String> {
    let (model, width) = (plan.model(), plan.image_size().width);
    let matches_any = |label| (model.disparity(label).unsigned_abs() as usize) < width;
    if !(0..model.labels() as u16).any(matches_any) {
        return Some("with this --min-disparity no label matches anything inside the right image".to_owned());
    }
    let (labels, last) = (model.labels() as u16, model.labels() as u16 - 1);
    let which = if matches_any(last) { (!matches_any(0)).then_some("first")? } else { "last" };
    Some(format!("{labels} labels for images {width} pixels wide: the {which} ones match nowhere"))
}
