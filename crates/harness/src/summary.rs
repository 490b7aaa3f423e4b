//! A record in brief: every plan on every backend, over all scenes.

use std::collections::HashMap;

pub(crate) use crate::statistics::{interval, mean_of_medians, ratio_interval};

use crate::record::{Cell, Measurement, Record, Sample};

/// A plan on a backend, over the scenes of a record.
pub(crate) struct Group<'a> {
    pub plan: &'a str,
    pub backend: &'a str,
    /// One per scene, in order.
    pub cells: Vec<Option<&'a Cell>>,
}

/// The groups of a record, in the order of their first cells.
pub(crate) fn groups(record: &Record) -> Vec<Group<'_>> {
    let scenes: HashMap<_, _> = record.scenes.iter().enumerate().map(|(at, scene)| (scene.name.as_str(), at)).collect();
    let mut places = HashMap::new();
    let mut groups = Vec::new();
    for cell in &record.cells {
        let Some(&scene) = scenes.get(cell.scene.as_str()) else { continue };
        let place = *places.entry((&cell.plan, &cell.backend)).or_insert(groups.len());
        if place == groups.len() {
            groups.push(Group { plan: &cell.plan, backend: &cell.backend, cells: vec![None; record.scenes.len()] });
        }
        groups[place].cells[scene].get_or_insert(cell);
    }
    groups
}

impl<'a> Group<'a> {
    /// The scenes with results: each one's index and its cell's measurement.
    pub(crate) fn measured(&self) -> impl Iterator<Item = (usize, &'a Measurement)> {
        let cells = self.cells.iter().enumerate();
        cells.filter_map(|(at, cell)| Some((at, cell.and_then(Cell::measured).filter(|m| !m.samples.is_empty())?)))
    }

    /// All measurements; `None` if a scene lacks one, since means over different scenes are not comparable.
    pub(crate) fn whole(&self) -> Option<Vec<&'a Measurement>> {
        let measured: Vec<_> = self.measured().map(|(_, measurement)| measurement).collect();
        (!measured.is_empty() && measured.len() == self.cells.len()).then_some(measured)
    }

    /// The cell that provides the group's device.
    pub(crate) fn cell(&self) -> Option<&'a Cell> {
        self.cells.iter().flatten().find(|cell| cell.device.is_some()).copied()
    }
}

/// A time of every sample of each scene.
pub(crate) fn samples(measured: &[&Measurement], ms: fn(&Sample) -> f64) -> Vec<Vec<f64>> {
    measured.iter().map(|measurement| measurement.samples.iter().map(ms).collect()).collect()
}

/// The mean of a number over the scenes.
pub(crate) fn mean(measured: &[&Measurement], value: fn(&Measurement) -> f64) -> f64 {
    measured.iter().map(|measurement| value(measurement)).sum::<f64>() / measured.len() as f64
}
