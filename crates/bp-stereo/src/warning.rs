//! Warnings about a pair or its labels, found before the pair is matched.

use std::fmt;

use bp_core::{
    Alignment, Plan,
    survey::{RowOffsets, SeenDisparities, Survey},
};

use crate::{Labels, Options};

/// A possible problem with a pair or its labels.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// Both images are the same.
    Identical,
    /// Hardly anything matches.
    Unlike,
    /// The images have this number of shades only.
    FewShades(u16),
    /// Too little matches to find labels; a quarter of the width is used.
    NoLabelsFound,
    /// The images look exchanged.
    Exchanged,
    /// Corresponding points are not on the same row.
    Rows(RowOffsets),
    /// The pair has disparities beyond the labels.
    Beyond(Beyond),
    /// Some labels match nothing inside the right image.
    Unused(Unused),
}

/// So many shades are few. Values of 14 bits that were stored in 16 have these at most; public photographs have more than 120.
const FEW_SHADES: u16 = 64;

/// Disparities beyond the labels, in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Beyond {
    /// The least and the largest disparity seen.
    pub seen: [i32; 2],
    /// The disparity of the first and of the last label.
    pub labels: [i32; 2],
    /// A change of options that would include them.
    advice: &'static str,
    /// A hint at automatic labels; empty if they are already in use.
    automatic: &'static str,
}

/// Labels that match nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unused {
    /// Number of labels.
    pub labels: usize,
    /// Width of the images in pixels.
    pub width: usize,
    /// Which labels match nothing: "first", "last" or "all".
    pub which: &'static str,
}

/// The warnings from the survey of a pair, from its plan, and from a failed search for labels.
pub(crate) fn of(
    options: &Options,
    survey: &Survey,
    alignment: Option<&Alignment>,
    plan: &Plan,
    found_labels: bool,
) -> Vec<Warning> {
    // A negative `min_disparity` shows that the order of the images is intended.
    let exchanged = survey.exchanged && options.min_disparity.is_none_or(|first| first >= 0);
    let mut warnings = Vec::new();
    let mut add = |is_so: bool, warning| warnings.extend(is_so.then_some(warning));
    let has_few_shades = survey.shades <= FEW_SHADES && !options.stretch;
    add(has_few_shades, Warning::FewShades(survey.shades));
    // In so few shades, different images may be the same.
    add(survey.identical && !has_few_shades, Warning::Identical);
    add(survey.unlike, Warning::Unlike);
    add(!found_labels, Warning::NoLabelsFound);
    add(exchanged, Warning::Exchanged);
    // Slight offsets that were aligned are no problem any more.
    let rows = survey.rows.filter(|rows| alignment.is_none() || !rows.is_slight());
    warnings.extend(rows.map(Warning::Rows));
    // Disparities are unreliable if rows do not correspond, and exchanged images have their own warning.
    let trusted = rows.is_none() && !exchanged;
    let beyond = survey.seen.filter(|_| trusted).and_then(|seen| beyond(options, seen, plan));
    warnings.extend(beyond.map(Warning::Beyond));
    warnings.extend(unused(plan).map(Warning::Unused));
    warnings
}

fn beyond(options: &Options, seen: SeenDisparities, plan: &Plan) -> Option<Beyond> {
    let model = plan.model();
    let (first, last) = (model.min_disparity(), model.disparity(model.labels() as u16 - 1));
    let advice = match seen.beyond(model) {
        [false, false] => return None,
        [true, _] if first > seen.largest => "lower `min_disparity`",
        [_, true] if last < seen.least && options.min_disparity.is_some() => "raise `min_disparity`",
        [true, false] => "lower `min_disparity`",
        [false, true] => "raise `labels`",
        [true, true] => "lower `min_disparity` and raise `labels`",
    };
    let automatic = match (options.labels, options.min_disparity) {
        (Labels::Auto, None) => "",
        (Labels::Auto, Some(_)) => ", or leave it to `labels` auto",
        _ => ", or use `labels` auto",
    };
    Some(Beyond { seen: [seen.least, seen.largest], labels: [first, last], advice, automatic })
}

fn unused(plan: &Plan) -> Option<Unused> {
    let (model, width) = (plan.model(), plan.image_size().width);
    let labels = model.labels();
    let matches_any = |label: u16| (model.disparity(label).unsigned_abs() as usize) < width;
    let last = labels as u16 - 1;
    let which = match (matches_any(0), matches_any(last)) {
        (true, true) => return None,
        (true, false) => "last",
        (false, true) => "first",
        (false, false) if (0..labels as u16).any(matches_any) => "last",
        (false, false) => "all",
    };
    Some(Unused { labels, width, which })
}

impl Warning {
    /// The warning as the end of a sentence that begins with "3 more pairs".
    #[must_use]
    pub fn of_many(&self) -> &'static str {
        match self {
            Self::Identical => "show the same image twice",
            Self::Unlike => "hardly match",
            Self::FewShades(_) => "have few shades",
            Self::NoLabelsFound => "match too little to find labels",
            Self::Exchanged => "look exchanged",
            Self::Rows(_) => "have rows that do not correspond",
            Self::Beyond(_) => "have disparities beyond the labels",
            Self::Unused(_) => "have labels that match nowhere",
        }
    }

    /// The warning as a sentence about a pair with this name.
    #[must_use]
    pub fn about(&self, pair: &str) -> String {
        match self {
            Self::Identical => format!("{pair} are the same image: nothing in it is nearer or farther"),
            Self::Unlike => {
                format!(
                    "hardly anything in {pair} matches: they show different scenes, are far from rectified, or are blank"
                )
            }
            Self::FewShades(shades) => {
                format!(
                    "{pair} have only {shades} of 256 shades: if their values do not use their bits in full, `stretch` them"
                )
            }
            Self::NoLabelsFound => {
                format!("too little in {pair} matches to find the disparities to search: give `labels` a number")
            }
            Self::Exchanged => {
                format!("{pair} look exchanged: swap them, or give a negative `min_disparity` if that is meant")
            }
            Self::Rows(rows) => format!("rows of {pair} do not correspond ({}): rectify them first", apart(*rows)),
            Self::Beyond(Beyond { seen, labels, advice, automatic }) => {
                let seen = format!("{pair} have disparities from about {} to {} px", seen[0], seen[1]);
                format!("{seen}, but the labels reach from {} to {}: {advice}{automatic}", labels[0], labels[1])
            }
            Self::Unused(Unused { which: "all", .. }) => {
                "with this `min_disparity` no label matches anything inside the right image".to_owned()
            }
            Self::Unused(Unused { labels, width, which }) => {
                format!("{labels} labels for images {width} pixels wide: the {which} ones match nowhere")
            }
        }
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(&self.about("the images"))
    }
}

/// The row offsets in words.
fn apart(RowOffsets { whole, left, right, top, bottom }: RowOffsets) -> String {
    let off = |rows: i32| format!("{} px too {}", rows.abs(), if rows < 0 { "high" } else { "low" });
    if whole != 0 && [left, right, top, bottom].iter().all(|&part| part == whole) {
        return format!("the second lies {}", off(whole));
    }
    let [left, right, top, bottom] = [left, right, top, bottom].map(off);
    format!("the second lies {left} at the left, {right} at the right, {top} at the top, {bottom} at the bottom")
}
