//! Compares several records for `bp compare`.

mod speed_ups;
mod tables;

use std::{collections::HashMap, path::Path};

use serde::Serialize;
use speed_ups::SpeedUps;
pub use tables::page;

use crate::{
    escape::printable,
    failure::Failure,
    record::{Cell, Device, Machine, Measurement, Program, Record, Sample, Settings},
    summary::{Group, groups, interval, mean, mean_of_medians, ratio_interval, samples},
};

/// The results of several records for the same plans and scenes.
#[derive(Serialize)]
pub struct Comparison<'a> {
    data: &'a str,
    labels: usize,
    k: u32,
    scenes: Vec<&'a str>,
    records: Vec<Source<'a>>,
    rows: Vec<Row<'a>>,
    speed_ups: SpeedUps<'a>,
    /// How to read the numbers.
    note: &'static str,
}

/// The record that a column comes from.
#[derive(Serialize)]
struct Source<'a> {
    path: String,
    started: &'a str,
    complete: bool,
    machine: &'a Machine,
    program: &'a Program,
    devices: Vec<Used<'a>>,
}

/// A backend's device.
#[derive(Serialize)]
struct Used<'a> {
    backend: &'a str,
    device: &'a Device,
}

/// A plan on a backend, with its values in every record.
#[derive(Serialize)]
struct Row<'a> {
    plan: &'a str,
    backend: &'a str,
    /// The index of the record that has this row, if only one does.
    only_in: Option<usize>,
    /// One value per record, in the order of the records.
    values: Vec<Value<'a>>,
}

/// A plan on a backend in a record.
#[derive(Serialize)]
struct Value<'a> {
    /// How many scenes have measurements.
    measured_scenes: usize,
    /// The means over the scenes; `None` unless all of them have measurements.
    means: Option<Means>,
    /// Scenes whose labels differ from those of the first cell with this plan, see `Firsts`.
    other_labels: Vec<&'a str>,
    /// Scenes whose settings differ from those of that cell.
    other_settings: Vec<&'a str>,
}

#[derive(Serialize)]
struct Means {
    total: Time,
    message_passing: Time,
    visible_bad_1px_percent: f64,
    visible_rmse_px: f64,
    energy: f64,
}

/// The mean over the scenes of each scene's median.
#[derive(Serialize)]
struct Time {
    ms: f64,
    interval_ms: Option<[f64; 2]>,
    /// This time over that of the first record.
    ratio: Option<f64>,
    ratio_interval: Option<[f64; 2]>,
}

/// How to read the numbers.
const NOTE: &str = "Times are means over the scenes of the median of each; message passing is timed by the \
                    device's own clock where it has one. Ratios are a record's time over that of record 1, so that \
                    less than 1 is faster. In brackets stand 95 % intervals of the ratios by the percentile \
                    bootstrap, from three samples of every scene on. Records were not taken in turns: each side is \
                    resampled for itself, and the intervals tell how samples scatter within a run, not how \
                    machines, their load or their clocks differ from one day to another. Of few samples they are \
                    rather too narrow.";

impl<'a> Comparison<'a> {
    /// Compares records. The first one is the baseline.
    pub fn new(records: &'a [(&'a Path, Record)]) -> Result<Self, Failure> {
        let Some(((first_path, first), others)) = records.split_first() else {
            return Err(Failure::usage("no record to compare"));
        };
        others.iter().try_for_each(|(path, record)| check_same(path, record, first_path, first))?;
        let scenes: Vec<_> = first.scenes.iter().map(|scene| scene.name.as_str()).collect();
        let rows = rows(records);
        let all: Vec<_> = records.iter().map(|(_, record)| record).collect();
        Ok(Self {
            data: &first.run.data,
            labels: first.run.labels,
            k: first.run.k,
            records: records.iter().map(|(path, record)| Source::new(path, record)).collect(),
            speed_ups: SpeedUps::new(&all, &rows, &scenes),
            scenes,
            rows,
            note: NOTE,
        })
    }
}

/// Fails unless both records are of the same problem, so that one table can hold their numbers.
fn check_same(path: &Path, record: &Record, first_path: &Path, first: &Record) -> Result<(), Failure> {
    let (run, other) = (&record.run, &first.run);
    let differs = |what: &str, here: String, there: String| {
        let (here, there, first) = (printable(&here), printable(&there), first_path.display());
        let why = format!("{what} {here}, but {there} in {first}; compare records of the same images, L and k");
        Err(Failure::reading(path, &why))
    };
    if run.quick != other.quick {
        let kind = |quick| if quick { "a quick run (--quick)" } else { "a full one" }.to_owned();
        return differs("it is", kind(run.quick), kind(other.quick));
    }
    if run.data != other.data {
        return differs("its data set is", run.data.clone(), other.data.clone());
    }
    if run.labels != other.labels {
        return differs("it has L =", run.labels.to_string(), other.labels.to_string());
    }
    if run.k != other.k {
        return differs("it has k =", run.k.to_string(), other.k.to_string());
    }
    if record.scenes != first.scenes {
        let names =
            |record: &Record| record.scenes.iter().map(|scene| scene.name.as_str()).collect::<Vec<_>>().join(" ");
        return differs("its scenes, or the checksums of their images, differ:", names(record), names(first));
    }
    Ok(())
}

impl<'a> Source<'a> {
    fn new(path: &Path, record: &'a Record) -> Self {
        let device = |backend: &'a String| {
            let cell = record.cells.iter().find(|cell| cell.backend == *backend && cell.device.is_some())?;
            Some(Used { backend, device: cell.device.as_ref()? })
        };
        Self {
            path: path.display().to_string(),
            started: &record.started,
            complete: record.complete,
            machine: &record.machine,
            program: &record.program,
            devices: record.run.backends.iter().filter_map(device).collect(),
        }
    }
}

/// Every plan on every backend that any record measured. Plans keep the order in which they first appear.
fn rows<'a>(records: &'a [(&'a Path, Record)]) -> Vec<Row<'a>> {
    let mut sought = Vec::new();
    let mut found = HashMap::new();
    for (at, (_, record)) in records.iter().enumerate() {
        for group in groups(record).into_iter().filter(|group| group.measured().next().is_some()) {
            let key = (group.plan, group.backend);
            if !sought.contains(&key) {
                sought.push(key);
            }
            found.insert((at, key), group);
        }
    }
    let mut firsts = Firsts::default();
    let mut placed: Vec<_> = sought.into_iter().map(|(plan, backend)| (firsts.place(plan), (plan, backend))).collect();
    placed.sort_by_key(|&(place, _)| place);
    let row = |(_, (plan, backend))| {
        let groups: Vec<Option<Group<'a>>> =
            (0..records.len()).map(|at| found.remove(&(at, (plan, backend)))).collect();
        let mut having = groups.iter().enumerate().filter(|(_, group)| group.is_some()).map(|(at, _)| at);
        let only_in = having.next().filter(|_| having.next().is_none());
        let base = groups.first().and_then(Option::as_ref).and_then(Group::whole);
        let values = groups.iter().map(|group| value(group.as_ref(), base.as_deref(), &mut firsts)).collect();
        Row { plan, backend, only_in, values }
    };
    placed.into_iter().map(row).collect()
}

/// The order in which plans first appear, and the first measured cell of each plan and scene. All others are compared
/// with that cell. Backends and commits give the same labels, so it matters little whose cell it is.
#[derive(Default)]
struct Firsts<'a> {
    plans: Vec<&'a str>,
    cells: HashMap<(&'a str, &'a str), &'a Cell>,
}

impl<'a> Firsts<'a> {
    fn place(&mut self, plan: &'a str) -> usize {
        self.plans.iter().position(|&known| known == plan).unwrap_or_else(|| {
            self.plans.push(plan);
            self.plans.len() - 1
        })
    }

    fn of(&mut self, cell: &'a Cell) -> &'a Cell {
        self.cells.entry((cell.plan.as_str(), cell.scene.as_str())).or_insert(cell)
    }
}

fn value<'a>(group: Option<&Group<'a>>, base: Option<&[&Measurement]>, firsts: &mut Firsts<'a>) -> Value<'a> {
    let mut value = Value { measured_scenes: 0, means: None, other_labels: Vec::new(), other_settings: Vec::new() };
    let Some(group) = group else { return value };
    for cell in group.measured().filter_map(|(at, _)| group.cells[at]) {
        let first = firsts.of(cell);
        let labels = |cell: &'a Cell| cell.measured().map(|measured| &measured.labels_sha256);
        if labels(cell) != labels(first) {
            value.other_labels.push(&cell.scene);
        }
        if problem(&cell.settings) != problem(&first.settings) {
            value.other_settings.push(&cell.scene);
        }
    }
    value.measured_scenes = group.measured().count();
    value.means = group.whole().and_then(|measured| means(&measured, base));
    value
}

/// The settings that define the computation: all but `planned_bytes`, which depend on the device.
fn problem(settings: &Settings) -> Settings {
    Settings { planned_bytes: None, ..settings.clone() }
}

fn means(measured: &[&Measurement], base: Option<&[&Measurement]>) -> Option<Means> {
    Some(Means {
        total: time(measured, base, |sample| sample.total_ms)?,
        message_passing: time(measured, base, Sample::message_passing_ms)?,
        visible_bad_1px_percent: mean(measured, |m| m.visible.bad[1]),
        visible_rmse_px: mean(measured, |m| m.visible.rmse),
        energy: mean(measured, |m| m.energy.total as f64),
    })
}

fn time(measured: &[&Measurement], base: Option<&[&Measurement]>, ms: fn(&Sample) -> f64) -> Option<Time> {
    let ours = samples(measured, ms);
    let theirs = base.map(|base| samples(base, ms));
    let mean = mean_of_medians(&ours)?;
    let ratio = theirs.as_deref().and_then(mean_of_medians).map(|base| mean / base).filter(|ratio| ratio.is_finite());
    let ratio_interval = ratio.and(theirs.as_deref()).and_then(|base| ratio_interval(&ours, base));
    Some(Time { ms: mean, interval_ms: interval(&ours), ratio, ratio_interval })
}
