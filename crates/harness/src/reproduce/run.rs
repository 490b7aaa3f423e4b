//! Takes the samples: round after round, scenes and plans in turns, saving each.

use std::{ops::ControlFlow, time::Instant};

use bp_core::{Driver, Energy, Times};
use bp_io::{Files, Raster};
use sha2::{Digest, Sha256};

use super::{
    energies,
    plans::{self, Planned},
    storage::Storage,
};
use crate::{
    backends::{Asked, Opened},
    failure::Failure,
    files::hex,
    interrupt::ProgressBar,
    machine,
    record::{self, Cell, Derived, Measurement, Outcome, Record, Sample, Settings},
    scenes::{Scene, Source},
};

/// A cell whose first sample takes more milliseconds gets no other: its run would take too long, and short disturbances
/// matter less to it.
pub const ONE_SAMPLE_ABOVE_MS: f64 = 5000.0;

/// Nanoseconds a message entry, to guess before the first sample which cells will get others.
const GUESSED_NS: f64 = 2.5;

/// Runs all cells that the record does not hold yet, on these devices and the scenes that are asked for. What failed
/// after other samples of its cell, which are kept, is returned: no outcome tells it.
pub(crate) fn run(
    source: &Source,
    devices: &mut [Asked],
    storage: &mut Storage,
    is_asked: &dyn Fn(&str) -> bool,
) -> Result<Vec<String>, Failure> {
    let bar = ProgressBar::new(1);
    bar.message("loading the scenes".to_owned());
    let mut scenes = (0..source.names().len()).map(|index| source.load(index)).collect::<Result<Vec<_>, _>>()?;
    scenes.iter().try_for_each(|scene| add_scene(storage, scene, devices))?;
    scenes.retain(|scene| is_asked(&scene.record.name));
    let mut failed = Vec::new();
    bar.resume_at(done(storage.record()));
    // A round takes in all scenes: so the samples of each spread over the whole run, and what else the machine does for a
    // while meets a few of all rather than all of a few.
    for round in 0..storage.record().run.samples {
        for scene in &scenes {
            bar.set_total(work(storage.record(), is_asked));
            for planned in plans::all() {
                for device in devices.iter_mut().filter_map(|asked| asked.device.as_mut().ok()) {
                    failed.extend(sample_cell(scene, &planned, device, round, storage, &bar)?);
                }
            }
        }
    }
    let wants_energies = !storage.record().run.quick && storage.record().labellings.is_empty() && !scenes.is_empty();
    if let Some(folder) = source.folder().filter(|_| wants_energies) {
        bar.message("outside energies".to_owned());
        let done = done(storage.record());
        storage.record_mut().labellings = energies::compare(folder, &mut |_| bar.update(done))?;
    }
    bar.finish();
    let record = storage.record_mut();
    record.complete = record.cells.iter().all(|cell| cell.outcome != Outcome::Pending);
    storage.save()?;
    Ok(failed)
}

/// Adds a scene and its cells to the record, or checks that the record's scene is this one and goes on with its cells.
fn add_scene(storage: &mut Storage, scene: &Scene, devices: &[Asked]) -> Result<(), Failure> {
    let (folder, run) = (storage.folder().display().to_string(), storage.record().run.clone());
    let other = |what: &str| Failure::input(format!("{folder} was begun with another {what}; begin anew elsewhere"));
    let cells = planned_cells(scene, devices, &run)?;
    let record = storage.record_mut();
    match record.scenes.iter().find(|known| known.name == scene.record.name) {
        None => record.scenes.push(scene.record.clone()),
        Some(known) if *known != scene.record => return Err(other(&known.name)),
        Some(_) => {}
    }
    for cell in cells {
        let is_it = |old: &&mut Cell| (&old.scene, &old.plan, &old.backend) == (&cell.scene, &cell.plan, &cell.backend);
        match record.cells.iter_mut().find(is_it) {
            None => record.cells.push(cell),
            Some(old) if old.measured().is_none() => *old = cell,
            Some(old) if old.device != cell.device => return Err(other(&format!("device as {}", cell.backend))),
            Some(_) => {}
        }
    }
    storage.save()
}

/// The cells of a scene before they are run.
fn planned_cells(scene: &Scene, devices: &[Asked], run: &record::Run) -> Result<Vec<Cell>, Failure> {
    let mut cells = Vec::new();
    for planned in plans::all() {
        let plan = planned.plan(scene.pair.size(), run.labels, run.k)?;
        cells.extend(devices.iter().map(|Asked { name, device }| {
            let opened = device.as_ref().ok();
            let device_of_plan = opened.map(|opened| opened.device.as_ref());
            Cell {
                scene: scene.record.name.clone(),
                plan: planned.name.to_owned(),
                backend: name.clone(),
                device: opened.map(|opened| (&opened.info).into()),
                settings: Settings::new(
                    &plan,
                    device_of_plan,
                    planned.algorithm,
                    Derived { k: planned.k(run.k), z: planned.z },
                ),
                outcome: device.as_ref().map_or_else(|e| Outcome::Unavailable(e.clone()), |_| Outcome::Pending),
            }
        }));
    }
    Ok(cells)
}

/// Takes the sample of one round, where the cell still wants it. Samples that a cell has are not lost when this one
/// fails: the failure is returned, and the cell gets no more.
fn sample_cell(
    scene: &Scene,
    planned: &Planned,
    device: &mut Opened,
    round: u32,
    storage: &mut Storage,
    bar: &ProgressBar,
) -> Result<Option<String>, Failure> {
    let (name, plan) = (&scene.record.name, planned.name);
    let is_it = |cell: &Cell| cell.scene == *name && cell.plan == plan && cell.backend == device.name;
    let record = storage.record();
    let Some(index) = record.cells.iter().position(is_it) else { return Ok(None) };
    if !wants_sample(&record.cells[index], round) {
        return Ok(None);
    }
    bar.message(format!("{name} {plan} {}", device.name));
    let before = done(record);
    let outcome = match solve(scene, planned, device, &record.run, &mut |done| bar.update(before + done)) {
        Ok(solved) => {
            let total_ms = 1000.0 * solved.times.total.as_secs_f64();
            bar.line(&format!("{name:<11}{plan:<10}{:<8}{total_ms:>10.1} ms", device.name));
            measured(&record.cells[index], round, scene, solved, storage)?
        }
        Err(failure) if failure.is_interrupted() => return Err(failure),
        Err(failure) => {
            device.note(failure.cause());
            bar.line(&format!("{name:<11}{plan:<10}{:<8} {failure}", device.name));
            if record.cells[index].measured().is_some() {
                return Ok(Some(format!("{name}, {plan} on {}: round {}: {failure}", device.name, round + 1)));
            }
            let beyond = failure.is_beyond_device();
            if beyond { Outcome::Unavailable(failure.to_string()) } else { Outcome::Error(failure.to_string()) }
        }
    };
    storage.record_mut().cells[index].outcome = outcome;
    storage.save()?;
    Ok(None)
}

fn wants_sample(cell: &Cell, round: u32) -> bool {
    match &cell.outcome {
        Outcome::Pending => round == 0,
        Outcome::Error(_) | Outcome::Unavailable(_) => false,
        Outcome::Measured(measurement) => {
            let taken = measurement.samples.len() as u32;
            taken == round && measurement.samples.iter().all(|sample| sample.total_ms <= ONE_SAMPLE_ABOVE_MS)
        }
    }
}

/// A finished solve.
struct Solved {
    driver: Driver,
    prepare_ms: f64,
    compile_ms: Option<f64>,
    times: Times,
}

fn solve(
    scene: &Scene,
    planned: &Planned,
    device: &mut Opened,
    run: &record::Run,
    update: &mut dyn FnMut(u64) -> ControlFlow<()>,
) -> Result<Solved, Failure> {
    device.recover()?;
    let plan = planned.plan(scene.pair.size(), run.labels, run.k)?;
    machine::check_memory(device.info.kind, device.device.planned_bytes(&plan), "--quick needs less")?;
    let start = Instant::now();
    let mut driver = Driver::new(device.device.as_ref(), plan)?;
    let prepare_ms = 1000.0 * start.elapsed().as_secs_f64();
    let compile_ms = driver.compile_time().map(|time| 1000.0 * time.as_secs_f64());
    let times = driver.solve_observed(&scene.pair, &mut |progress| update(progress.done))?;
    Ok(Solved { driver, prepare_ms, compile_ms, times })
}

/// Adds a sample to a cell's measurement. The first one brings the answer's quality and map; all samples on all devices
/// must answer the same.
fn measured(cell: &Cell, round: u32, scene: &Scene, solved: Solved, storage: &Storage) -> Result<Outcome, Failure> {
    let labels: Vec<u8> = solved.driver.labels().iter().flat_map(|label| label.to_le_bytes()).collect();
    let labels_sha256 = hex(&Sha256::digest(labels));
    let same = |other: &&Cell| other.scene == cell.scene && other.plan == cell.plan;
    for other in storage.record().cells.iter().filter(same) {
        if other.measured().is_some_and(|measured| measured.labels_sha256 != labels_sha256) {
            return Ok(Outcome::Error(format!("other labels than an earlier run on {}", other.backend)));
        }
    }
    let sample = Sample {
        round,
        prepare_ms: solved.prepare_ms,
        compile_ms: solved.compile_ms,
        total_ms: 1000.0 * solved.times.total.as_secs_f64(),
        clocks: record::clocks(&solved.times),
    };
    let mut measurement = match cell.measured() {
        Some(measurement) => measurement.clone(),
        None => first_measurement(cell, scene, &solved.driver, labels_sha256, storage)?,
    };
    measurement.samples.push(sample);
    Ok(Outcome::Measured(Box::new(measurement)))
}

/// What does not vary from sample to sample; writes the disparity map.
fn first_measurement(
    cell: &Cell,
    scene: &Scene,
    driver: &Driver,
    labels_sha256: String,
    storage: &Storage,
) -> Result<Measurement, Failure> {
    let disparities = driver.disparities();
    let errors = scene.truth.errors(&disparities)?;
    let visible = errors.visible.ok_or_else(|| Failure::other("a scene without visible pixels"))?;
    let map = format!("{}/{}-{}.png", record::MAPS_FOLDER, cell.scene, cell.plan);
    Raster::disparities(&disparities).write(&Files::default(), &storage.folder().join(&map))?;
    Ok(Measurement {
        samples: Vec::new(),
        allocated_bytes: driver.allocated_bytes(),
        energy: Energy::of(&scene.pair, driver.plan().model(), driver.labels())?.into(),
        all: errors.all.into(),
        visible: visible.into(),
        labels_sha256,
        map,
    })
}

/// Message entries of all samples taken so far.
fn done(record: &Record) -> u64 {
    let samples = |cell: &Cell| cell.measured().map_or(0, |measurement| measurement.samples.len() as u64);
    record.cells.iter().map(|cell| samples(cell) * cell.settings.message_updates).sum()
}

/// Message entries of the whole run, as far as can be told: cells to come are taken to be as fast as guessed.
fn work(record: &Record, is_asked: &dyn Fn(&str) -> bool) -> u64 {
    let samples = |cell: &Cell| {
        let first = cell.measured().and_then(|measurement| measurement.samples.first());
        let guess = cell.settings.message_updates as f64 * GUESSED_NS / 1e6;
        let total_ms = first.map_or(guess, |sample| sample.total_ms);
        match cell.outcome {
            Outcome::Error(_) | Outcome::Unavailable(_) => 0,
            _ if total_ms > ONE_SAMPLE_ABOVE_MS => 1,
            _ => u64::from(record.run.samples),
        }
    };
    let asked = record.cells.iter().filter(|cell| is_asked(&cell.scene));
    asked.map(|cell| samples(cell) * cell.settings.message_updates).sum()
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::Ordering;

    use super::{super::storage, *};
    use crate::{
        args::DataArgs,
        backends::flaky::{self, Flaky},
    };

    #[test]
    fn a_lost_device_is_opened_again_and_no_sample_is_lost_with_it() {
        let folder = tempfile::tempdir().unwrap();
        let source = Source::new(&DataArgs { data: None, synthetic: true }, true).unwrap();
        let run = record::Run {
            data: source.set.name.to_owned(),
            quick: true,
            labels: source.set.labels,
            k: 1,
            samples: 2,
            backends: vec!["flaky".to_owned()],
            threads: None,
        };
        let backend: &'static Flaky = Box::leak(Box::default());
        let mut devices = [Asked { name: "flaky".to_owned(), device: Ok(flaky::open(backend).unwrap()) }];
        let mut storage = storage::open(folder.path(), machine::machine(Some("test")), run).unwrap();
        let scene = source.load(0).unwrap();
        add_scene(&mut storage, &scene, &devices).unwrap();
        let device = devices[0].device.as_mut().unwrap();
        let plans = plans::all();
        let mut sample = |plan: usize, round| {
            let failed = sample_cell(&scene, &plans[plan], device, round, &mut storage, &ProgressBar::new(1)).unwrap();
            let outcome = storage.record().cells[plan].outcome.clone();
            (failed, outcome, backend.opened.load(Ordering::Relaxed))
        };
        let samples = |outcome: &Outcome| match outcome {
            Outcome::Measured(measurement) => measurement.samples.len(),
            _ => 0,
        };
        let (failed, outcome, opened) = sample(0, 0);
        assert_eq!((failed, samples(&outcome), opened), (None, 1, 1));
        let (failed, outcome, opened) = sample(0, 1);
        let told = failed.unwrap();
        assert!(told.contains("round 2: flaky did not answer within 60 s"), "{told}");
        assert_eq!((samples(&outcome), opened), (1, 1));
        let (failed, outcome, opened) = sample(1, 0);
        assert_eq!((failed, samples(&outcome), opened), (None, 1, 2));
        let (failed, outcome, opened) = sample(2, 0);
        assert!(matches!(outcome, Outcome::Error(_)), "{outcome:?}");
        assert_eq!((failed, opened), (None, 2));
        let (failed, outcome, opened) = sample(3, 0);
        assert_eq!((failed, samples(&outcome), opened), (None, 1, 3));
    }
}
