//! A record, with the queries that tables and charts need.

use super::{format::Spread, thesis::Thesis};
use crate::{
    failure::Failure,
    record::{Arrangement, Cell, Device, Measurement, Outcome, Record, Sample, Scene},
    scenes,
};

/// The part of a solve that a time belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// The stages `refine` and `update_messages`.
    MessagePassing,
    /// From images to labels.
    Total,
}

impl Part {
    /// Its time in a sample, in milliseconds.
    pub(super) fn ms(self, sample: &Sample) -> f64 {
        match self {
            Self::MessagePassing => sample.message_passing_ms(),
            Self::Total => sample.total_ms,
        }
    }
}

/// A record and the numbers that the thesis prints.
pub(super) struct Results<'a> {
    pub(super) record: &'a Record,
    pub(super) thesis: Thesis,
}

impl<'a> Results<'a> {
    pub(super) fn new(record: &'a Record) -> Result<Self, Failure> {
        Ok(Self { record, thesis: Thesis::read()? })
    }

    /// The scenes with their number in the thesis, from 0.
    pub(super) fn scenes(&self) -> impl Iterator<Item = (usize, &'a Scene)> + use<'a> {
        self.record.scenes.iter().enumerate()
    }

    /// The backends.
    pub(super) fn backends(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        self.record.run.backends.iter().map(String::as_str)
    }

    /// All scenes on all backends.
    pub(super) fn rows(&self) -> impl Iterator<Item = Row<'_>> {
        self.scenes().flat_map(move |(index, scene)| {
            self.backends().map(move |backend| Row { record: self.record, index, scene, backend })
        })
    }

    /// The source of the images, in words.
    pub(super) fn data(&self) -> &'a str {
        let name = &self.record.run.data;
        scenes::set(name).map_or(name, |set| set.described)
    }

    /// The devices that were used, each with its backend's name.
    pub(super) fn devices(&self) -> Vec<(&'a str, &'a Device)> {
        self.backends().filter_map(|backend| Some((backend, device(self.record, backend)?))).collect()
    }

    /// A backend's name in tables and charts.
    pub(super) fn label(&self, backend: &str) -> String {
        label(self.record, backend)
    }

    /// The mean of a value over the scenes on a backend; `None` if a scene has no value.
    pub(super) fn mean(&self, backend: &str, value: impl Fn(&Row<'_>) -> Option<f64>) -> Option<f64> {
        let rows = self.rows().filter(|row| row.backend == backend);
        Spread::mean(rows.map(|row| value(&row)).collect::<Option<Vec<f64>>>()?)
    }

    /// The word shown when a plan has no mean over the scenes.
    pub(super) fn missing_mean(&self, backend: &str, plan: &str, otherwise: &'static str) -> &'static str {
        let mut rows = self.rows().filter(|row| row.backend == backend);
        if rows.any(|row| row.missing(plan) == UNAVAILABLE) { UNAVAILABLE } else { otherwise }
    }

    /// Why cells are unavailable, in a sentence; `None` if all are available.
    pub(super) fn unavailable(&self) -> Option<String> {
        let mut reasons = Vec::new();
        for cell in &self.record.cells {
            let Outcome::Unavailable(reason) = &cell.outcome else { continue };
            let plan = cell.device.as_ref().map_or(String::new(), |_| format!(", {}", cell.plan));
            let line = format!("{}{plan}: {reason}", cell.backend);
            if !reasons.contains(&line) {
                reasons.push(line);
            }
        }
        (!reasons.is_empty()).then(|| format!("Unavailable: {}.", reasons.join("; ")))
    }

    /// Images, labels and loops, for every table and chart.
    pub(super) fn setting(&self) -> String {
        let run = &self.record.run;
        let quick = if run.quick { "quick run, " } else { "" };
        format!(
            "{quick}{}, L = {}, k = {}",
            scenes::set(&run.data).map_or(run.data.as_str(), |set| set.short),
            run.labels,
            run.k
        )
    }
}

/// The word shown for a plan that the machine cannot run.
pub(super) const UNAVAILABLE: &str = "unavailable";

/// A backend's device; `None` if it could not be opened.
fn device<'a>(record: &'a Record, backend: &str) -> Option<&'a Device> {
    record.cells.iter().find(|cell| cell.backend == backend)?.device.as_ref()
}

/// A backend's name. A software rasteriser is named as one, since its times are not a GPU's.
fn label(record: &Record, backend: &str) -> String {
    let software = device(record, backend).is_some_and(|device| device.software_rasteriser);
    format!("{backend}{}", if software { " (software rasteriser)" } else { "" })
}

/// A scene on a backend.
#[derive(Clone, Copy)]
pub(super) struct Row<'a> {
    record: &'a Record,
    /// Number of the scene in the thesis, from 0.
    pub(super) index: usize,
    pub(super) scene: &'a Scene,
    pub(super) backend: &'a str,
}

impl<'a> Row<'a> {
    /// The backend's name in tables.
    pub(super) fn label(&self) -> String {
        label(self.record, self.backend)
    }

    /// A plan's cell.
    pub(super) fn cell(&self, plan: &str) -> Option<&'a Cell> {
        self.record.cell(&self.scene.name, plan, self.backend)
    }

    /// A plan's measurement.
    pub(super) fn measured(&self, plan: &str) -> Option<&'a Measurement> {
        self.cell(plan)?.measured()
    }

    /// The plan that this one is compared with: BP, and on one worker if this one has a worker for each part.
    fn base(&self, plan: &str) -> &'static str {
        let one_worker = "bp-one-worker";
        if self.workers(plan).is_some() && self.cell(one_worker).is_some() { one_worker } else { "bp" }
    }

    /// The number of workers of a plan that runs its parts side by side.
    pub(super) fn workers(&self, plan: &str) -> Option<usize> {
        match self.cell(plan)?.arrangement? {
            Arrangement::SideBySide { workers } => Some(workers),
            Arrangement::OneWorker | Arrangement::InTurn => None,
        }
    }

    /// Whether the backend runs on the CPU, without an API in between.
    pub(super) fn is_processor(&self) -> bool {
        device(self.record, self.backend).is_some_and(|device| device.api.is_none())
    }

    /// Why a plan has no numbers here.
    pub(super) fn missing(&self, plan: &str) -> &'a str {
        match self.cell(plan).map(|cell| &cell.outcome) {
            Some(Outcome::Error(error)) => error,
            Some(Outcome::Unavailable(_)) => UNAVAILABLE,
            Some(Outcome::Measured(_)) => "-",
            _ => "not run",
        }
    }

    /// A plan's times. Of parts side by side, the stages have none: those of several workers overlap.
    pub(super) fn time(&self, plan: &str, part: Part) -> Option<Spread> {
        if part == Part::MessagePassing && self.workers(plan).is_some() {
            return None;
        }
        Spread::of(self.measured(plan)?.samples.iter().map(|sample| part.ms(sample)))
    }

    /// The times of BP that a plan is compared with.
    pub(super) fn base_time(&self, plan: &str, part: Part) -> Option<Spread> {
        self.time(self.base(plan), part)
    }

    /// The speed-up of a plan over BP: the ratio of medians. Its range covers the ratios of samples from the same
    /// round, if there are at least three such rounds.
    pub(super) fn speed_up(&self, plan: &str, part: Part) -> Option<Spread> {
        let median = self.base_time(plan, part)?.median / self.time(plan, part)?.median;
        let (bp, other) = (self.measured(self.base(plan))?, self.measured(plan)?);
        let same_round = |a: &Sample| {
            let b = other.samples.iter().find(|b| b.round == a.round)?;
            Some(part.ms(a) / part.ms(b))
        };
        let ratios = Spread::of(bp.samples.iter().filter_map(same_round))?;
        let (low, high) = if ratios.count >= 3 { (ratios.low, ratios.high) } else { (median, median) };
        Some(Spread { median, low: low.min(median), high: high.max(median), count: ratios.count })
    }
}
