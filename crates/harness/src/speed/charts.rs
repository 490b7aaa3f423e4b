//! The results of `bp speed` as charts, drawn from its record alone.

use bp_charts::{Axis, BLACK, Key, Level, Line, Plot, Point, Series, Style, Value};
use bp_core::Stage;

use crate::{
    record::{
        Sample,
        speed::{Contest, Contestant, Entry, Family, Speed, StageTime},
    },
    statistics::Spread,
};

/// A chart with its file name and caption.
pub(super) struct Chart {
    /// File name without extension.
    pub name: &'static str,
    pub plot: Plot,
    /// How to read the chart.
    pub caption: String,
}

/// The file names, without extension, of all charts that a run can have.
pub(super) fn names() -> impl Iterator<Item = &'static str> {
    Family::ALL.into_iter().map(Family::name).chain(["roofline"])
}

/// All charts that this run has numbers for.
pub(super) fn charts(speed: &Speed) -> Vec<Chart> {
    Family::ALL.into_iter().filter_map(|family| growth(speed, family)).chain(roofline(speed)).collect()
}

/// A chart of time against the number that varies within a family.
pub(super) fn growth(speed: &Speed, family: Family) -> Option<Chart> {
    let contests: Vec<_> = speed.contests_of(Some(family)).collect();
    let series: Vec<_> = contests.first()?.entries.iter().map(|entry| grown(speed, family, entry)).collect();
    let names: Vec<_> = series.iter().map(|series| series.name.as_str()).collect();
    let title = match family {
        Family::Pixels | Family::Labels | Family::Loops => format!("Time against {}", family.name()),
        Family::SweepPixels => "Time of a sweep against pixels".to_owned(),
        Family::HalfStepPixels => "Time of half-steps against pixels".to_owned(),
        Family::HalfStepLabels => "Time of half-steps against labels".to_owned(),
    };
    let ticks = contests.iter().map(|contest| family.number_of(contest) as f64).collect();
    let plot = Plot {
        description: format!("{title}. Series: {}.", names.join("; ")),
        x: Axis { ticks, ..Axis::logarithmic(family.grows()) },
        y: Axis::logarithmic("milliseconds from images to labels"),
        levels: Vec::new(),
        keys: Vec::new(),
        series,
        title,
    };
    let caption = "Medians by the wall clock; whiskers from the least to the greatest of the rounds.".to_owned();
    Some(Chart { name: family.name(), plot, caption })
}

/// The times, over a family, of the contestant that `first` belongs to.
fn grown(speed: &Speed, family: Family, first: &Entry) -> Series<Point> {
    let point = |contest: &Contest| {
        let own = contest.entries.iter().find(|entry| entry.contestant == first.contestant)?;
        let ms = Sample::spread(&own.outcome.measured()?.samples, |sample| sample.total_ms)?;
        Some(Point::new(family.number_of(contest) as f64, with_range(ms)))
    };
    let place = speed.place(&first.contestant);
    Series {
        name: speed.label(first),
        // Every second line is dashed, so that both show where two coincide.
        style: Style::numbered(place).with_line(if place.is_multiple_of(2) { Line::Solid } else { Line::Dashes }),
        points: speed.contests_of(Some(family)).filter_map(point).collect(),
    }
}

/// A chart of the memory throughput of each device's stages. It also shows the rate at which the device copies memory.
pub(super) fn roofline(speed: &Speed) -> Option<Chart> {
    let contestants = speed.contestants.iter().map(|contestant| (contestant, rates(speed, contestant)));
    let (devices, others): (Vec<_>, Vec<_>) = contestants.partition(|(_, rates)| !rates.is_empty());
    let level = |(device, _): &(&Contestant, _)| {
        let name = format!("{}: copying", device.label());
        Some(Level { name, value: device.copy_gb_per_s?, colour: Some(speed.place(&device.name)) })
    };
    let is_shown = |stage: &Stage| devices.iter().flat_map(|(_, rates)| rates).any(|(shown, _)| shown == stage);
    let key = |stage: Stage| Key { name: stage.name().to_owned(), style: Style::marked(BLACK, stage as usize) };
    let title = "Stages beside the rate of copying";
    let plot = Plot {
        title: title.to_owned(),
        description: format!("{title}: what each device's stages move a second in each problem, and what it copies."),
        x: Axis::logarithmic("MB that a stage has to read and write at least"),
        y: Axis::logarithmic("GB/s read and written"),
        levels: devices.iter().filter_map(level).collect(),
        keys: Stage::ALL.into_iter().filter(is_shown).map(key).collect(),
        series: devices.iter().flat_map(|(device, rates)| stages(speed, device, rates)).collect(),
    };
    let others: Vec<_> = others.iter().map(|(contestant, _)| contestant.label()).collect();
    let missing = if others.is_empty() { String::new() } else { format!(" Not in it: {}.", others.join(", ")) };
    let caption = format!(
        "A point a stage of a problem. Bytes are the least that it has to read and write, each value of a step counted \
         once; caches may serve some of them, so that a point may lie above its line. Whiskers go from the least to \
         the greatest of the rounds. Devices that count no bytes, or have no clock of their own, cannot be shown.{missing}"
    );
    (!devices.is_empty()).then_some(Chart { name: "roofline", plot, caption })
}

/// One series per point: the colour identifies the device, the shape identifies the stage.
fn stages(speed: &Speed, device: &Contestant, rates: &[(Stage, Point)]) -> Vec<Series<Point>> {
    let series = |&(stage, point): &(Stage, Point)| Series {
        name: format!("{}: {}", device.label(), stage.name()),
        style: Style::marked(speed.place(&device.name), stage as usize),
        points: vec![point],
    };
    rates.iter().map(series).collect()
}

/// The bytes and throughput of a device's stages in all problems; empty if its copy rate is unknown.
fn rates(speed: &Speed, device: &Contestant) -> Vec<(Stage, Point)> {
    let own = |entry: &&Entry| entry.contestant == device.name && device.copy_gb_per_s.is_some();
    let measured = speed.contests.iter().flat_map(|contest| contest.entries.iter().filter(own));
    let point = |time: StageTime| {
        let rate = with_range(time.gb_per_s()?);
        Some((time.stage, Point::new(time.bytes? as f64 / 1e6, rate)))
    };
    measured
        .filter_map(|entry| entry.outcome.measured())
        .flat_map(|measured| device.stages(measured).filter_map(point))
        .collect()
}

/// The median, with its range if there are three samples or more.
fn with_range(Spread { median, low, high, count }: Spread) -> Value {
    if count >= 3 { Value { value: median, low, high } } else { median.into() }
}
