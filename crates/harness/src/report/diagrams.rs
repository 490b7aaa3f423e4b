//! The 14 diagrams of the thesis. Those of times come with one of speed-ups each.

use bp_charts::{Axis, DotChart, Fill, Key, Level, Series, Style, Value};

use super::{
    Drawing,
    format::{Spread, mebibytes, number},
    legend,
    results::{Part, Results, Row},
    tables::{BP, CFBP, CFCSBP, CTBP, CTCSBP, Named, Table, family, thesis_plans, with_parts},
};
use crate::{failure::Failure, record::Measurement};

/// A value for each scene.
type PerScene = Series<Option<Value>>;

/// The part of a chart that shows one plan: its series, and their entries in the legend.
#[derive(Default)]
struct Group {
    series: Vec<PerScene>,
    keys: Vec<Key>,
}

/// The number of a diagram in the thesis, and that of the table it belongs to.
#[derive(Clone, Copy)]
struct Numbers {
    diagram: &'static str,
    table: &'static str,
}

const fn numbers(diagram: &'static str, table: &'static str) -> Numbers {
    Numbers { diagram, table }
}

/// All diagrams, in order.
pub(super) fn all(results: &Results<'_>) -> Result<Vec<Drawing>, Failure> {
    let both = [Part::MessagePassing, Part::Total];
    let mut drawings = Vec::new();
    // The thesis has no diagram of CTBP's memory, which equals BP's.
    for (plans, speed, memory, reliability) in [
        (&[CFBP][..], numbers("4.1", "3.18"), Some(numbers("4.2", "3.19")), numbers("4.3", "3.20")),
        (&[CFCSBP], numbers("4.4", "3.21"), Some(numbers("4.5", "3.22")), numbers("4.6", "3.23")),
        (&[CTBP], numbers("4.7", "3.24"), None, numbers("4.8", "3.25")),
        (&CTCSBP, numbers("4.9", "3.26"), Some(numbers("4.10", "3.27")), numbers("4.11", "3.28")),
    ] {
        let what = format!("{} against BP", family(plans));
        // However the parts are arranged, the labels are the same.
        let arranged = with_parts(results, plans);
        drawings.extend(speeds(results, speed, &what, &arranged, &both)?);
        let with_bp = [&[BP], arranged.as_slice()].concat();
        drawings.extend(memory.map(|memory| memories(results, memory, &what, &with_bp)).transpose()?);
        drawings.push(errors(results, reliability, &what, &[&[BP], plans].concat())?);
    }
    let five = [BP, CFBP, CFCSBP, CTBP, CTCSBP[0]];
    let what = "All algorithms against BP";
    drawings.extend(speeds(results, numbers("4.12", "3.29"), what, &thesis_plans()[1..], &[Part::Total])?);
    drawings.push(memories(results, numbers("4.13", "3.30"), "All algorithms", &five)?);
    drawings.push(errors(results, numbers("4.14", "3.31"), "All algorithms", &five)?);
    for (drawing, why) in drawings.iter_mut().flat_map(|drawing| Some((drawing, results.unavailable()?))) {
        drawing.caption += &format!(" {why}");
    }
    Ok(drawings)
}

/// What a diagram of processing speed shows.
#[derive(Clone, Copy)]
enum Speed {
    /// Times, as in the thesis.
    Milliseconds,
    /// The same as speed-ups over BP.
    SpeedUp,
}

impl Speed {
    fn measured(self, row: &Row<'_>, plan: &Named, part: Part) -> Option<Spread> {
        match self {
            Self::Milliseconds => row.time(plan.plan, part),
            Self::SpeedUp => row.speed_up(plan.plan, part),
        }
    }

    fn printed(self, results: &Results<'_>, plan: &Named, index: usize) -> Option<f64> {
        let ms = results.thesis.time_ms(plan.printed?, index)?;
        match self {
            Self::Milliseconds => Some(ms),
            Self::SpeedUp => Some(results.thesis.time_ms("bp", index)? / ms),
        }
    }

    /// The heading, the axis and how to read the values.
    fn words(self) -> [&'static str; 3] {
        match self {
            Self::Milliseconds => ["processing time", "ms", "Lower is faster."],
            Self::SpeedUp => [
                "speed-up",
                "time of BP / time of the plan",
                "A value above 1 is faster than BP; parts side by side are compared with BP on one worker.",
            ],
        }
    }
}

/// Two diagrams: the times of BP and of these plans, and the speed-ups of these plans over BP.
fn speeds(
    results: &Results<'_>,
    numbers: Numbers,
    what: &str,
    plans: &[Named],
    parts: &[Part],
) -> Result<[Drawing; 2], Failure> {
    let times = speed(results, numbers, what, &[&[BP], plans].concat(), parts, Speed::Milliseconds)?;
    let speed_ups = speed(results, numbers, what, plans, parts, Speed::SpeedUp)?;
    let name = format!("{}-speed-up", times.name);
    Ok([times, Drawing { name, ..speed_ups }])
}

fn speed(
    results: &Results<'_>,
    numbers: Numbers,
    what: &str,
    plans: &[Named],
    parts: &[Part],
    shown: Speed,
) -> Result<Drawing, Failure> {
    let group = |plan: &Named| {
        let mut group = Group::default();
        let overlaps = results.rows().any(|row| row.workers(plan.plan).is_some());
        for &part in parts.iter().filter(|&&part| part == Part::Total || !overlaps) {
            let (name, fill) = match part {
                Part::MessagePassing => ("message passing", Fill::Pale),
                Part::Total => ("total", Fill::Solid),
            };
            let name = format!("{}: {name}", plan.title);
            group.add_measured(results, plan, name, fill, |row| shown.measured(row, plan, part));
        }
        if plan.printed.is_some() {
            group.add_printed(results, plan, |index| shown.printed(results, plan, index));
        }
        group
    };
    let [heading, axis, note] = shown.words();
    let as_fast = matches!(shown, Speed::SpeedUp).then_some(1.0);
    let groups = plans.iter().map(group);
    let chart = chart(results, format!("{what}: {heading}"), Axis::logarithmic(axis), groups, as_fast);
    let pale = if parts.len() == 1 { "" } else { " Pale markers show message passing alone." };
    let caption = format!(
        "{note} Filled markers show the total time, measured in this run. Hollow markers show what the thesis \
         prints for the same plan on its GPU.{pale} Whiskers are ranges over rounds."
    );
    drawing(numbers, chart, &caption)
}

fn memories(results: &Results<'_>, numbers: Numbers, what: &str, plans: &[Named]) -> Result<Drawing, Failure> {
    let groups = measured(results, plans, |measured| mebibytes(measured.allocated_bytes));
    let chart = chart(results, format!("{what}: required memory"), Axis::linear("MiB allocated"), groups, None);
    drawing(numbers, chart, "Allocated bytes, as counted. The thesis prints no memory figure.")
}

fn errors(results: &Results<'_>, numbers: Numbers, what: &str, plans: &[Named]) -> Result<Drawing, Failure> {
    let groups = measured(results, plans, |measured| measured.all.rmse);
    let axis = Axis::linear("R, root mean squared error over all known pixels, px");
    let chart = chart(results, format!("{what}: reliability"), axis, groups, None);
    drawing(numbers, chart, "R is defined by equation 2.82. Lower is better. The thesis prints no reliability figure.")
}

/// One value of each plan's measurement.
fn measured(
    results: &Results<'_>,
    plans: &[Named],
    value: impl Fn(&Measurement) -> f64,
) -> impl Iterator<Item = Group> {
    plans.iter().map(move |plan| {
        let mut group = Group::default();
        group.add_measured(results, plan, plan.title.to_owned(), Fill::Solid, |row| {
            let value = value(row.measured(plan.plan)?);
            Some(Spread { median: value, low: value, high: value, count: 1 })
        });
        group
    })
}

impl Group {
    /// Adds a series for each device.
    fn add_measured(
        &mut self,
        results: &Results<'_>,
        plan: &Named,
        name: String,
        fill: Fill,
        value: impl Fn(&Row<'_>) -> Option<Spread>,
    ) {
        let has_label = !legend::devices(results).is_empty();
        let series = |(i, (backend, _)): (usize, (&str, _))| Series {
            name: if has_label { format!("{name}, {}", results.label(backend)) } else { name.clone() },
            style: legend::style(results, plan, i).filled(fill),
            points: (results.rows().filter(|row| row.backend == backend))
                .map(|row| value(&row).map(|Spread { median, low, high, .. }| Value { value: median, low, high }))
                .collect(),
        };
        self.series.extend(results.devices().into_iter().enumerate().map(series));
        self.keys.push(Key { style: legend::any_device(results, plan).filled(fill), name });
    }

    /// Adds the printed values of a plan. The thesis's Z'''' is not known, so all plans of CTCSBP
    /// have the same.
    fn add_printed(&mut self, results: &Results<'_>, plan: &Named, value: impl Fn(usize) -> Option<f64>) {
        let name = format!("{}: printed", plan.title);
        let style: Style = legend::any_device(results, plan).filled(Fill::Hollow);
        self.keys.push(Key { name: name.clone(), style });
        let points = results.scenes().map(|(index, _)| value(index).map(Value::from)).collect();
        self.series.push(Series { name, style, points });
    }
}

/// A chart of these groups. The legend names what the groups show, and the devices.
fn chart(
    results: &Results<'_>,
    title: String,
    axis: Axis,
    groups: impl Iterator<Item = Group>,
    reference: Option<f64>,
) -> DotChart {
    let (mut keys, mut series) = (Vec::new(), Vec::new());
    for group in groups {
        keys.extend(group.keys);
        series.push(group.series);
    }
    keys.extend(legend::devices(results));
    let names: Vec<_> = series.iter().flatten().map(|series| series.name.as_str()).collect();
    let level = |value| Level { name: "as fast as BP".to_owned(), value, colour: None };
    DotChart {
        description: format!("{title}, on {}. Series: {}.", results.data(), names.join("; ")),
        axis: Axis { name: format!("{}; {}", axis.name, results.setting()), ..axis },
        levels: reference.into_iter().map(level).collect(),
        keys,
        categories: results.scenes().map(|(_, scene)| scene.name.clone()).collect(),
        groups: series,
        title,
    }
}

fn drawing(Numbers { diagram, table }: Numbers, chart: DotChart, caption: &str) -> Result<Drawing, Failure> {
    let svg = chart.svg().map_err(|error| Failure::other(format!("diagram {diagram}: {error}")))?;
    Ok(Drawing {
        name: format!("diagram-{diagram}"),
        title: format!("Diagram {diagram} (Table {table}): {}", chart.title),
        caption: caption.to_owned(),
        svg,
        table: Some(data_table(&chart)),
    })
}

/// The numbers of a chart: a row for each scene.
fn data_table(chart: &DotChart) -> Table {
    let columns: Vec<&str> =
        std::iter::once("scene").chain(chart.series().map(|series| series.name.as_str())).collect();
    let rows = chart.categories.iter().enumerate().map(|(i, category)| {
        let value = |series: &PerScene| match series.points.get(i).copied().flatten() {
            None => "-".to_owned(),
            Some(Value { value, low, high }) if low < high => {
                format!("{} ({} to {})", number(value, 2), number(low, 2), number(high, 2))
            }
            Some(Value { value, .. }) => number(value, 2),
        };
        std::iter::once(category.clone()).chain(chart.series().map(value)).collect()
    });
    Table::new("", chart.axis.name.clone(), &columns).rows(rows)
}
