//! The 14 diagrams of the thesis.

use bp_charts::{Axis, DotChart, Key, Level, Series, Style, Value};

use super::{
    Drawing,
    format::{Spread, mebibytes, number},
    legend,
    results::{Part, Results, Row},
    tables::{BP, CFBP, CFCSBP, CTBP, CTCSBP, Named, Table, family},
};
use crate::{
    failure::Failure,
    record::{Device, Measurement},
};

/// A value a scene.
type PerScene = Series<Option<Value>>;

/// One kind of number of one plan: a series a device.
struct Group {
    name: String,
    series: Vec<PerScene>,
}

/// Number of a diagram, and of the table that it belongs to.
type Numbers = (&'static str, &'static str);

/// All diagrams, in order.
pub(super) fn all(results: &Results<'_>) -> Result<Vec<Drawing>, Failure> {
    let mut drawings = against_bp(results, &[CFBP], ("4.1", "3.18"), Some(("4.2", "3.19")), ("4.3", "3.20"))?;
    drawings.extend(against_bp(results, &[CFCSBP], ("4.4", "3.21"), Some(("4.5", "3.22")), ("4.6", "3.23"))?);
    // The thesis has two diagrams here, not three: CTBP's memory equals BP's.
    drawings.extend(against_bp(results, &[CTBP], ("4.7", "3.24"), None, ("4.8", "3.25"))?);
    drawings.extend(against_bp(results, &CTCSBP, ("4.9", "3.26"), Some(("4.10", "3.27")), ("4.11", "3.28"))?);
    let four = [CFBP, CFCSBP, CTBP, CTCSBP[0]];
    let five = [BP, CFBP, CFCSBP, CTBP, CTCSBP[0]];
    drawings.push(speed_ups(results, ("4.12", "3.29"), "All algorithms against BP", &four, &[Part::Total])?);
    drawings.push(memories(results, ("4.13", "3.30"), "All algorithms", &five)?);
    drawings.push(errors(results, ("4.14", "3.31"), "All algorithms", &five)?);
    for (drawing, why) in drawings.iter_mut().flat_map(|drawing| Some((drawing, results.unavailable()?))) {
        drawing.caption += &format!(" {why}");
    }
    Ok(drawings)
}

/// Speed, memory and reliability of one algorithm.
fn against_bp(
    results: &Results<'_>,
    plans: &[Named],
    speed: Numbers,
    memory: Option<Numbers>,
    reliability: Numbers,
) -> Result<Vec<Drawing>, Failure> {
    let what = format!("{} against BP", family(plans));
    let with_bp: Vec<Named> = std::iter::once(BP).chain(plans.iter().copied()).collect();
    let mut drawings = vec![speed_ups(results, speed, &what, plans, &[Part::MessagePassing, Part::Total])?];
    if let Some(memory) = memory {
        drawings.push(memories(results, memory, &what, &with_bp)?);
    }
    drawings.push(errors(results, reliability, &what, &with_bp)?);
    Ok(drawings)
}

fn speed_ups(
    results: &Results<'_>,
    numbers: Numbers,
    what: &str,
    plans: &[Named],
    parts: &[Part],
) -> Result<Drawing, Failure> {
    let mut groups = Vec::new();
    for plan in plans {
        for &part in parts {
            let name = match part {
                Part::MessagePassing => format!("{}: message passing", plan.title),
                Part::Total => format!("{}: total", plan.title),
            };
            let series = ours(results, &name, groups.len(), |row| row.speed_up(plan.plan, part));
            groups.push(Group { name, series });
        }
    }
    // Where each plan has one group, its printed series looks alike; else those are told apart among themselves.
    let first_look = if groups.len() == plans.len() { 0 } else { groups.len() };
    let printed = printed(results, plans, first_look);
    let chart = chart(results, format!("{what}: speed-up"), "time of BP / time of plan", (groups, printed), Some(1.0));
    let ours = if parts.len() == 1 { "ours are in all too" } else { "ours are apart for message passing and in all" };
    let caption = format!(
        "Above 1 is faster than BP. Printed times are of the thesis's GPU program in all; {ours}. Whiskers, where there \
         are any, are ranges over rounds."
    );
    drawing(numbers, chart, &caption)
}

/// The printed speed-ups of some plans; their looks are numbered from `first_look` on.
fn printed(results: &Results<'_>, plans: &[Named], first_look: usize) -> Vec<PerScene> {
    // The same numbers are printed for every digit that CTCSBP's coefficient may have had.
    let mut plans: Vec<Named> = plans.to_vec();
    plans.dedup_by_key(|plan| plan.printed);
    let value = |plan: &Named, index| {
        let algorithm = plan.printed?;
        let value = results.thesis.time_ms("bp", index)? / results.thesis.time_ms(algorithm, index)?;
        Some(value.into())
    };
    let look = if results.devices().len() > 1 { legend::any_device } else { Style::numbered };
    let series = |(i, plan): (usize, &Named)| Series {
        name: format!("{}: printed in the thesis", family(&[*plan])),
        style: look(first_look + i).hollow(),
        points: results.scenes().map(|(index, _)| value(plan, index)).collect(),
    };
    plans.iter().enumerate().map(series).collect()
}

fn memories(results: &Results<'_>, numbers: Numbers, what: &str, plans: &[Named]) -> Result<Drawing, Failure> {
    let groups = measured(results, plans, |measured| mebibytes(measured.allocated_bytes));
    let chart = chart(results, format!("{what}: required memory"), "MiB allocated", (groups, vec![]), None);
    drawing(numbers, chart, "Bytes allocated, counted. The thesis prints no memory figure.")
}

fn errors(results: &Results<'_>, numbers: Numbers, what: &str, plans: &[Named]) -> Result<Drawing, Failure> {
    let groups = measured(results, plans, |measured| measured.all.rmse);
    let chart = chart(results, format!("{what}: reliability"), "R over all known pixels, px", (groups, vec![]), None);
    let caption = "Root mean squared error (equation 2.82); less is better. The thesis prints no reliability figure.";
    drawing(numbers, chart, caption)
}

/// One value of each plan's measurement.
fn measured(results: &Results<'_>, plans: &[Named], value: impl Fn(&Measurement) -> f64) -> Vec<Group> {
    let of = |(i, plan): (usize, &Named)| {
        let series = ours(results, plan.title, i, |row| {
            let value = value(row.measured(plan.plan)?);
            Some(Spread { median: value, low: value, high: value, count: 1 })
        });
        Group { name: plan.title.to_owned(), series }
    };
    plans.iter().enumerate().map(of).collect()
}

/// A series a backend that has a device, named after it where there are several or it only seems a GPU; their group has
/// this number.
fn ours(results: &Results<'_>, name: &str, group: usize, value: impl Fn(&Row<'_>) -> Option<Spread>) -> Vec<PerScene> {
    let devices = results.devices();
    let named = |device: &Device| results.backends().count() > 1 || device.software_rasteriser;
    let series = |(i, &(backend, device)): (usize, &(&str, &Device))| Series {
        name: if named(device) { format!("{name}, {}", results.label(backend)) } else { name.to_owned() },
        style: if devices.len() > 1 { legend::style(group, i) } else { Style::numbered(group) },
        points: (results.rows().filter(|row| row.backend == backend))
            .map(|row| value(&row).map(|Spread { median, low, high, .. }| Value { value: median, low, high }))
            .collect(),
    };
    devices.iter().enumerate().map(series).collect()
}

/// A chart of groups of ours and of printed series. On several devices, the legend names groups and devices, not each
/// of their pairs.
fn chart(
    results: &Results<'_>,
    title: String,
    name: &str,
    (groups, printed): (Vec<Group>, Vec<PerScene>),
    reference: Option<f64>,
) -> DotChart {
    let mut keys = Vec::new();
    if results.devices().len() > 1 {
        keys = legend::keys(results, groups.iter().map(|group| group.name.clone()).enumerate());
        keys.extend(printed.iter().map(|series| Key { name: series.name.clone(), style: series.style }));
    }
    let series: Vec<_> = groups.into_iter().flat_map(|group| group.series).chain(printed).collect();
    let names: Vec<_> = series.iter().map(|series| series.name.as_str()).collect();
    let level = |value| Level { name: format!("reference: {value}"), value, colour: None };
    DotChart {
        description: format!("{title}, on {}. Series: {}.", results.data(), names.join("; ")),
        axis: Axis { logarithmic: reference.is_some(), ..Axis::linear(format!("{name}; {}", results.setting())) },
        levels: reference.into_iter().map(level).collect(),
        keys,
        categories: results.scenes().map(|(_, scene)| scene.name.clone()).collect(),
        series,
        title,
    }
}

fn drawing((number, table): Numbers, chart: DotChart, caption: &str) -> Result<Drawing, Failure> {
    let svg = chart.svg().map_err(|error| Failure::other(format!("diagram {number}: {error}")))?;
    Ok(Drawing {
        name: format!("diagram-{number}"),
        title: format!("Diagram {number} (Table {table}): {}", chart.title),
        caption: caption.to_owned(),
        svg,
        table: Some(data_table(&chart)),
    })
}

/// What a chart shows, in numbers: a row a scene.
fn data_table(chart: &DotChart) -> Table {
    let columns: Vec<&str> =
        std::iter::once("").chain(chart.series.iter().map(|series| series.name.as_str())).collect();
    let rows = chart.categories.iter().enumerate().map(|(i, category)| {
        let value = |series: &PerScene| match series.points.get(i).copied().flatten() {
            None => "-".to_owned(),
            Some(Value { value, low, high }) if low < high => {
                format!("{} ({} to {})", number(value, 2), number(low, 2), number(high, 2))
            }
            Some(Value { value, .. }) => number(value, 2),
        };
        std::iter::once(category.clone()).chain(chart.series.iter().map(value)).collect()
    });
    Table::new("", chart.axis.name.clone(), &columns).rows(rows.collect::<Vec<_>>())
}
