//! Takes the samples: plan after plan in turns, saving each.

use bp_core::{Backend, DeviceInfo, Energy, Matcher, Plan, Times};
use sha2::{Digest, Sha256};

use super::{
    energies,
    plans::{self, Planned},
    storage::{MAPS_FOLDER, Storage},
};
use crate::{
    backends,
    failure::Failure,
    files::{hex, write_map},
    interrupt::ProgressBar,
    machine,
    record::{self, Cell, Clock, Measurement, Outcome, Run, Sample},
    scenes::{Scene, Source},
};

/// A cell whose first sample takes more milliseconds gets no other: its run would take too long, and short disturbances
/// matter less to it.
pub const ONE_SAMPLE_ABOVE_MS: f64 = 5000.0;

/// Nanoseconds a message entry, to guess before the first sample which cells will get others.
const GUESSED_NS: f64 = 2.5;

/// Runs all cells that the record does not hold yet.
pub(crate) fn run(source: &Source, storage: &mut Storage) -> Result<(), Failure> {
    let bar = ProgressBar::new(1);
    for index in 0..crate::scenes::THESIS_SCENES.len() {
        bar.message(format!("scene {} of 6", index + 1));
        let scene = source.load(index)?;
        add_scene(storage, &scene)?;
        bar.set_total(work(storage.record(), index));
        bar.resume_at(done(storage.record()));
        run_scene(&scene, storage, &bar)?;
    }
    let quick = storage.record().run.quick;
    if let Some(folder) = source.folder().filter(|_| !quick && storage.record().labellings.is_empty()) {
        bar.message("outside energies".to_owned());
        let record = storage.record().clone();
        storage.record_mut().labellings = energies::compare(folder, &mut |_| bar.update(done(&record)))?;
    }
    bar.finish();
    storage.record_mut().complete = true;
    storage.save()
}

/// Adds a scene and its cells to the record, or checks that the record's scene is this one.
fn add_scene(storage: &mut Storage, scene: &Scene) -> Result<(), Failure> {
    let run = storage.record().run.clone();
    if let Some(known) = storage.record().scenes.iter().find(|known| known.name == scene.record.name) {
        if *known == scene.record {
            return Ok(());
        }
        let folder = storage.folder().display();
        return Err(Failure::input(format!("{folder} was begun with another {}; begin anew elsewhere", known.name)));
    }
    let mut cells = Vec::new();
    for planned in plans::all() {
        let plan = planned.plan(scene.pair.size(), &run)?;
        for name in &run.backends {
            cells.push(cell(&scene.record.name, &planned, &plan, backends::by_name(name)?, &run));
        }
    }
    let record = storage.record_mut();
    record.scenes.push(scene.record.clone());
    record.cells.extend(cells);
    storage.save()
}

/// A cell that is still to be run.
fn cell(scene: &str, planned: &Planned, plan: &Plan, backend: &dyn Backend, run: &Run) -> Cell {
    let (model, settings) = (plan.model(), plan.settings());
    let none = || DeviceInfo { name: "none".to_owned(), software_rasteriser: false };
    let device = backend.devices().into_iter().next().unwrap_or_else(none);
    Cell {
        scene: scene.to_owned(),
        plan: planned.name.to_owned(),
        backend: backend.name().to_owned(),
        device: device.name,
        software_rasteriser: device.software_rasteriser,
        profile: model.profile().name().to_owned(),
        labels: model.labels(),
        slope: model.slope(),
        truncation: model.truncation(),
        algorithm: planned.algorithm.name().to_owned(),
        k: planned.k(run),
        z: planned.z,
        grids: settings.grids,
        steps: settings.steps,
        schedule: settings.schedule.name().to_owned(),
        message_start: settings.message_start.name().to_owned(),
        cut: settings.cut.map(|cut| record::Cut { x: cut.x, y: cut.y, seed_start: cut.seed_start }),
        message_updates: plan.message_updates(),
        planned_bytes: plan.bytes(),
        outcome: Outcome::Pending,
    }
}

/// Rounds of one sample a cell, so that samples of different plans are taken in turns.
fn run_scene(scene: &Scene, storage: &mut Storage, bar: &ProgressBar) -> Result<(), Failure> {
    let run = storage.record().run.clone();
    for round in 0..run.samples {
        for planned in plans::all() {
            for backend in &run.backends {
                sample_cell(scene, &planned, backend, round, storage, bar)?;
            }
        }
    }
    Ok(())
}

/// Takes the sample of one round, where the cell still wants it.
fn sample_cell(
    scene: &Scene,
    planned: &Planned,
    backend: &str,
    round: u32,
    storage: &mut Storage,
    bar: &ProgressBar,
) -> Result<(), Failure> {
    let before = done(storage.record());
    let run = storage.record().run.clone();
    let is_it = |cell: &Cell| cell.scene == scene.record.name && cell.plan == planned.name && cell.backend == backend;
    let Some(index) = storage.record().cells.iter().position(is_it) else { return Ok(()) };
    if !wants_sample(&storage.record().cells[index], round) {
        return Ok(());
    }
    let map = format!("{MAPS_FOLDER}/{}-{}.png", scene.record.name, planned.name);
    bar.message(format!("{} {} {backend}", scene.record.name, planned.name));
    let outcome = match solve(scene, planned, backend, &run, &mut |done| bar.update(before + done)) {
        Ok(solved) => {
            let sample = sample(round, &solved);
            let line = format!("{:<11}{:<10}{backend:<8}{:>10.1} ms", scene.record.name, planned.name, sample.total_ms);
            bar.line(&line);
            measured(&storage.record().cells[index], scene, solved, sample, map, storage)?
        }
        Err(failure) if failure.is_interrupted() => return Err(failure),
        Err(failure) => Outcome::Error(failure.to_string()),
    };
    storage.record_mut().cells[index].outcome = outcome;
    storage.save()
}

fn wants_sample(cell: &Cell, round: u32) -> bool {
    match &cell.outcome {
        Outcome::Pending => round == 0,
        Outcome::Error(_) => false,
        Outcome::Measured(measurement) => {
            let taken = measurement.samples.len() as u32;
            taken == round && measurement.samples.iter().all(|sample| sample.total_ms <= ONE_SAMPLE_ABOVE_MS)
        }
    }
}

/// A finished solve.
struct Solved {
    matcher: Matcher,
    prepare_ms: f64,
    times: Times,
}

fn solve(
    scene: &Scene,
    planned: &Planned,
    backend: &str,
    run: &Run,
    update: &mut dyn FnMut(u64) -> std::ops::ControlFlow<()>,
) -> Result<Solved, Failure> {
    let plan = planned.plan(scene.pair.size(), run)?;
    machine::check_memory(plan.bytes(), "--quick needs less")?;
    let device = backends::by_name(backend)?.open(0)?;
    let start = std::time::Instant::now();
    let mut matcher = Matcher::new(device.as_ref(), plan)?;
    let prepare_ms = 1000.0 * start.elapsed().as_secs_f64();
    let times = matcher.solve_observed(&scene.pair, &mut |progress| update(progress.done))?;
    Ok(Solved { matcher, prepare_ms, times })
}

fn sample(round: u32, solved: &Solved) -> Sample {
    Sample {
        round,
        clock: Clock::Wall,
        prepare_ms: solved.prepare_ms,
        stages: (&solved.times).into(),
        total_ms: 1000.0 * solved.times.total.as_secs_f64(),
    }
}

/// Adds a sample to a cell's measurement; the first one brings the answer's quality and map, later ones must answer the
/// same.
fn measured(
    cell: &Cell,
    scene: &Scene,
    solved: Solved,
    sample: Sample,
    map: String,
    storage: &Storage,
) -> Result<Outcome, Failure> {
    let labels: Vec<u8> = solved.matcher.labels().iter().flat_map(|label| label.to_le_bytes()).collect();
    let labels_sha256 = hex(&Sha256::digest(labels));
    if let Some(measurement) = cell.measured() {
        if measurement.labels_sha256 != labels_sha256 {
            return Ok(Outcome::Error("two runs gave different labels".to_owned()));
        }
        let mut measurement = measurement.clone();
        measurement.samples.push(sample);
        return Ok(Outcome::Measured(Box::new(measurement)));
    }
    let disparities = solved.matcher.disparities();
    let errors = scene.truth.errors(&disparities)?;
    let visible = errors.visible.ok_or_else(|| Failure::other("a scene without visible pixels"))?;
    write_map(&storage.folder().join(&map), &disparities)?;
    Ok(Outcome::Measured(Box::new(Measurement {
        samples: vec![sample],
        allocated_bytes: solved.matcher.allocated_bytes(),
        energy: Energy::of(&scene.pair, solved.matcher.plan().model(), solved.matcher.labels())?.into(),
        all: errors.all.into(),
        visible: visible.into(),
        labels_sha256,
        map,
    })))
}

/// Message entries of all samples taken so far.
fn done(record: &record::Record) -> u64 {
    let samples = |cell: &Cell| cell.measured().map_or(0, |measurement| measurement.samples.len() as u64);
    record.cells.iter().map(|cell| samples(cell) * cell.message_updates).sum()
}

/// Message entries of the whole run, as far as can be told once the scenes up to `index` are known: those to come are
/// taken to be like these.
fn work(record: &record::Record, index: usize) -> u64 {
    let samples = |cell: &Cell| {
        let first = cell.measured().and_then(|measurement| measurement.samples.first());
        let total_ms = first.map_or(cell.message_updates as f64 * GUESSED_NS / 1e6, |sample| sample.total_ms);
        if total_ms > ONE_SAMPLE_ABOVE_MS { 1 } else { u64::from(record.run.samples) }
    };
    let known: u64 = record.cells.iter().map(|cell| samples(cell) * cell.message_updates).sum();
    known * 6 / (index as u64 + 1)
}
