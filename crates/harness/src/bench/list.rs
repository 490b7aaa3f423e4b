//! The named benches, for table rows and kernels, with their samples from records.

use std::time::Duration;

use bp_core::Stage;

use crate::{
    record::{Cell, Record, Sample, speed::Speed},
    report::table_of_times,
    reproduce,
    speed::Problem,
};

/// One time of one contestant, as passed to criterion.
#[derive(Clone, Debug)]
pub struct Bench {
    /// The table, or the kernel, that it belongs to.
    pub group: String,
    /// Its name in the group.
    pub name: String,
    /// Message entries that a sample computes, if the time is that of computing them.
    pub entries: Option<u64>,
    /// Minimum number of bytes that a sample reads and writes, if counted.
    pub bytes: Option<u64>,
    /// Every sample in the order taken; empty if it was not requested or cannot be measured.
    pub samples: Vec<Duration>,
    pub(super) of: Of,
}

impl Bench {
    /// The name that criterion displays and filters by.
    #[must_use]
    pub fn id(&self) -> String {
        format!("{}/{}", self.group, self.name)
    }
}

/// What has to be measured for a bench.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Of {
    Scene(&'static str),
    Problem(&'static str),
}

/// A time of a solve.
#[derive(Clone, Copy)]
enum Part {
    /// From images to labels, including all transfers and waiting.
    Total,
    /// All stages by the device's own clock, if it has one.
    OnDevice,
    /// `refine` and `update_messages`, by the device's clock if it has one.
    MessagePassing,
}

impl Part {
    const ALL: [Self; 3] = [Self::Total, Self::OnDevice, Self::MessagePassing];

    fn name(self) -> &'static str {
        match self {
            Self::Total => "total, wall clock",
            Self::OnDevice => "all stages, device's clock",
            Self::MessagePassing => "message passing",
        }
    }

    fn ms(self, sample: &Sample) -> Option<f64> {
        match self {
            Self::Total => Some(sample.total_ms),
            Self::OnDevice => sample.device_ms(),
            Self::MessagePassing => Some(sample.message_passing_ms()),
        }
    }
}

/// All benches of these scenes and backends, with their samples if they have been measured.
pub(super) fn benches(
    scenes: &[&'static str],
    backends: &[String],
    measured: Option<(&Record, Option<&Speed>)>,
) -> Vec<Bench> {
    let (record, speed) = measured.unzip();
    let mut benches = of_tables(scenes, backends, record);
    benches.extend(of_kernels(backends, speed.flatten()));
    benches
}

/// A bench for every time of every row of the tables of times.
fn of_tables(scenes: &[&'static str], backends: &[String], record: Option<&Record>) -> Vec<Bench> {
    let mut benches = Vec::new();
    for plan in reproduce::plans().into_iter().map(|planned| planned.name) {
        let (number, family) = table_of_times(plan);
        for (&scene, backend) in scenes.iter().flat_map(|scene| backends.iter().map(move |backend| (scene, backend))) {
            let cell = record.and_then(|record| record.cell(scene, plan, backend));
            benches.extend(Part::ALL.map(|part| Bench {
                group: format!("Table {number}, {family}"),
                name: format!("{plan} {scene} {backend}/{}", part.name()),
                entries: None,
                bytes: None,
                samples: samples(cell, part),
                of: Of::Scene(scene),
            }));
        }
    }
    benches
}

fn samples(cell: Option<&Cell>, part: Part) -> Vec<Duration> {
    let measured = cell.and_then(Cell::measured);
    durations(measured.iter().flat_map(|measured| &measured.samples).map(|sample| part.ms(sample)))
}

/// A bench for every stage of every problem. Backends differ in which stages are separate kernels.
fn of_kernels(backends: &[String], speed: Option<&Speed>) -> Vec<Bench> {
    let mut benches = Vec::new();
    for stage in Stage::ALL {
        for problem in Problem::KERNELS {
            benches.extend(backends.iter().map(|backend| kernel(stage, problem, backend, speed)));
        }
    }
    benches
}

fn kernel(stage: Stage, problem: &'static str, backend: &str, speed: Option<&Speed>) -> Bench {
    let contest = speed.and_then(|speed| speed.contests.iter().find(|contest| contest.problem == problem));
    let entry = contest.and_then(|contest| contest.entries.iter().find(|entry| entry.contestant == backend));
    let measured = entry.and_then(|entry| entry.outcome.measured());
    let bytes = measured.and_then(|measured| Some(measured.moved_bytes.as_ref()?.in_order()[stage as usize]));
    let bytes = bytes.filter(|&bytes| bytes > 0);
    let entries = contest.filter(|_| stage == Stage::UpdateMessages).map(|contest| contest.settings.message_updates);
    let schedule = contest.map_or("", |contest| &contest.settings.schedule);
    let contestant = speed.and_then(|speed| speed.contestants.iter().find(|contestant| contestant.name == backend));
    let samples = measured.map_or(&[][..], |measured| &measured.samples);
    let is_timed = contestant.zip(measured).is_some_and(|(contestant, measured)| contestant.times_stages(measured));
    let is_timed = is_timed && (entries.is_some() || bytes.is_some());
    Bench {
        group: format!("Kernel {}", stage.name()),
        name: format!("{problem} {backend}"),
        entries,
        bytes,
        samples: durations(samples.iter().map(|sample| is_timed.then(|| sample.kernel_ms(stage, schedule)))),
        of: Of::Problem(problem),
    }
}

/// Times in the type that criterion needs; empty if any of them is missing or zero.
fn durations(ms: impl Iterator<Item = Option<f64>>) -> Vec<Duration> {
    let duration = |ms: Option<f64>| Duration::try_from_secs_f64(ms? / 1000.0).ok().filter(|time| !time.is_zero());
    ms.map(duration).collect::<Option<_>>().unwrap_or_default()
}
