//! The speed-ups of the other plans over BP in each record, and whether the records agree. Ratios within a round can be
//! compared across runs although times cannot: both plans ran under the same conditions.

use std::fmt::Write as _;

use serde::Serialize;

use super::Row;
use crate::{
    record::{Record, Sample},
    report::{
        format::{number, or},
        lines,
    },
    statistics::{interval, median},
};

/// The baseline.
const BASE: &str = "bp";

/// Every plan on every backend and scene, and how far the records agree.
#[derive(Serialize)]
pub(super) struct SpeedUps<'a> {
    rows: Vec<SpeedUp<'a>>,
    /// One for each record but the first.
    agreement: Vec<Agreement>,
}

/// A plan on a backend and a scene.
#[derive(Serialize)]
struct SpeedUp<'a> {
    plan: &'a str,
    backend: &'a str,
    scene: &'a str,
    /// The ratios of the whole solve, one per record.
    total: Vec<Option<Ratio>>,
    /// The ratios of message passing, one per record.
    message_passing: Vec<Option<Ratio>>,
}

/// BP's time over the plan's: the median of the ratios within a round.
#[derive(Serialize)]
struct Ratio {
    median: f64,
    interval: Option<[f64; 2]>,
}

/// How many intervals of a record overlap those of the first.
#[derive(Serialize)]
struct Agreement {
    /// How many ratios have an interval in both records.
    intervals: usize,
    overlapping: usize,
}

impl<'a> SpeedUps<'a> {
    /// The speed-ups of these rows on these scenes.
    pub(super) fn new<'r>(records: &'r [&'r Record], rows: &[Row<'a>], scenes: &[&'a str]) -> Self {
        let plans = rows.iter().filter(|row| row.plan != BASE);
        let of_row = |row: &Row<'a>| {
            let (plan, backend) = (row.plan, row.backend);
            let ratios = move |scene: &str, ms: fn(&Sample) -> f64| -> Vec<Option<Ratio>> {
                records.iter().map(|record| ratio(record, (scene, plan, backend), ms)).collect()
            };
            scenes.iter().map(move |&scene| SpeedUp {
                plan,
                backend,
                scene,
                total: ratios(scene, |sample| sample.total_ms),
                message_passing: ratios(scene, Sample::message_passing_ms),
            })
        };
        let has_any = |row: &SpeedUp<'_>| row.total.iter().any(Option::is_some);
        let rows: Vec<_> = plans.flat_map(of_row).filter(has_any).collect();
        let agreement = (1..records.len()).map(|place| Agreement::of(&rows, place)).collect();
        Self { rows, agreement }
    }
}

/// The ratio of BP's time to a plan's in the same round; `None` if they share no round.
fn ratio(record: &Record, (scene, plan, backend): (&str, &str, &str), ms: fn(&Sample) -> f64) -> Option<Ratio> {
    let samples = |plan| Some(&record.cell(scene, plan, backend)?.measured()?.samples);
    let (base, own) = (samples(BASE)?, samples(plan)?);
    let ratios: Vec<f64> = Sample::ratios(base, own, ms).into_iter().filter(|ratio| ratio.is_finite()).collect();
    Some(Ratio { median: median(ratios.iter().copied())?, interval: interval(&[ratios]) })
}

/// Whether the intervals of a record and the first one overlap; `None` if either lacks an interval.
fn overlap(ratios: &[Option<Ratio>], place: usize) -> Option<bool> {
    let interval = |place: usize| ratios.get(place)?.as_ref()?.interval;
    let [[low, high], [other_low, other_high]] = [interval(0)?, interval(place)?];
    Some(low <= other_high && other_low <= high)
}

impl Agreement {
    fn of(rows: &[SpeedUp<'_>], place: usize) -> Self {
        let ratios = rows.iter().flat_map(|row| [&row.total, &row.message_passing]);
        let overlaps: Vec<bool> = ratios.filter_map(|ratios| overlap(ratios, place)).collect();
        let overlapping = overlaps.iter().filter(|&&overlaps| overlaps).count();
        Self { intervals: overlaps.len(), overlapping }
    }
}

/// The section of the page; empty if no plan can be compared with BP.
pub(super) fn section(speed_ups: &SpeedUps<'_>) -> String {
    let SpeedUps { rows, agreement } = speed_ups;
    if rows.is_empty() {
        return String::new();
    }
    let mut text =
        "\n## Speed-ups over BP, and whether their intervals overlap\n\nBP's time over the plan's on the same \
                    backend and scene: medians of the ratios within a round, with 95 % intervals by the percentile \
                    bootstrap from three rounds on. Plans of a round took turns, so that these ratios can be compared \
                    across runs.\n\n"
            .to_owned();
    for (place, Agreement { intervals, overlapping }) in (2..).zip(agreement) {
        let percent = match intervals {
            0 => String::new(),
            _ => format!(" ({} %)", number(100.0 * *overlapping as f64 / *intervals as f64, 1)),
        };
        let _ = writeln!(text, "* Record {place}: {overlapping} of {intervals} intervals{percent} overlap record 1's.");
    }
    let records = 0..=agreement.len();
    let heading = |record: usize| {
        let ratios = ["total", "message passing"].map(|what| format!("{}: {what}", record + 1));
        ratios.into_iter().chain((record > 0).then(|| format!("{} and 1 overlap", record + 1)))
    };
    let which = ["plan", "backend", "scene"].map(str::to_owned);
    let columns: Vec<_> = which.into_iter().chain(records.clone().flat_map(heading)).collect();
    let cells = |row: &SpeedUp<'_>| {
        let which = [row.plan, row.backend, row.scene].map(str::to_owned);
        which.into_iter().chain(records.clone().flat_map(|record| figures(row, record))).collect()
    };
    text + "\n" + &lines(&columns, &rows.iter().map(cells).collect::<Vec<_>>())
}

/// The cells of a record.
fn figures(row: &SpeedUp<'_>, record: usize) -> Vec<String> {
    let parts = [&row.total, &row.message_passing];
    let mut cells = parts.map(|ratios| or(ratios[record].as_ref().map(text), "-")).to_vec();
    if record > 0 {
        cells.push(match parts.map(|ratios| overlap(ratios, record)) {
            [None, _] | [_, None] => "-".to_owned(),
            [Some(true), Some(true)] => "both".to_owned(),
            [Some(true), Some(false)] => "total only".to_owned(),
            [Some(false), Some(true)] => "message passing only".to_owned(),
            [Some(false), Some(false)] => "neither".to_owned(),
        });
    }
    cells
}

fn text(ratio: &Ratio) -> String {
    let interval = ratio.interval.map(|[low, high]| format!(" ({} to {})", number(low, 3), number(high, 3)));
    number(ratio.median, 3) + &or(interval, "")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ratio(interval: Option<[f64; 2]>) -> Option<Ratio> {
        Some(Ratio { median: 1.0, interval })
    }

    #[test]
    fn intervals_that_share_a_point_overlap_and_missing_ones_do_not_count() {
        let first = ratio(Some([1.0, 2.0]));
        let row = |total, message_passing| SpeedUp {
            plan: "cfbp",
            backend: "rayon",
            scene: "books",
            total: vec![ratio(Some([1.0, 2.0])), total],
            message_passing: vec![first.as_ref().and_then(|first| ratio(first.interval)), message_passing],
        };
        let rows = [
            row(ratio(Some([2.0, 3.0])), ratio(Some([2.1, 3.0]))),
            row(ratio(Some([1.4, 1.5])), ratio(Some([0.0, 9.0]))),
            row(ratio(None), None),
            row(ratio(Some([0.1, 0.9])), ratio(None)),
        ];
        let Agreement { intervals, overlapping } = Agreement::of(&rows, 1);
        assert_eq!((overlapping, intervals), (3, 5));
        let told = [0, 1, 2, 3].map(|row| figures(&rows[row], 1).pop().unwrap());
        assert_eq!(told, ["total only", "both", "-", "-"]);
    }
}
