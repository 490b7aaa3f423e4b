//! Takes the samples: every plan on every scene and device, in turns. Saves each sample.

use std::{cell::RefCell, path::Path};

use bp_core::{Device, DisparityMap, Energy, Error, PartDriver, Plan};
use bp_io::Raster;
use bp_stereo::{Event, Watch};
use sha2::{Digest, Sha256};

use super::{
    energies,
    plans::{self, Planned},
    storage::Storage,
};
use crate::{
    failure::Failure,
    files::{below, hex},
    measure::{Arranged, Asked, Contestant, Entrant, Meter, Rules, Runner, SLOW_ROUNDS, take_turns},
    record::{self, Cell, Measurement, Outcome, Sample, Settings},
    scenes::{Scene, Source},
};

/// Runs all cells that are missing in the record, on these devices and the requested scenes. Returns the failures of
/// cells that keep earlier samples, because their outcomes do not show these failures.
pub fn run(
    source: &Source,
    devices: &[Asked],
    storage: &mut Storage,
    is_asked: &dyn Fn(&str) -> bool,
    watch: &Watch<'_>,
) -> Result<Vec<String>, Failure> {
    watch.tell(Event::Task("loading the scenes"));
    let mut scenes = (0..source.names().len()).map(|index| source.load(index)).collect::<Result<Vec<_>, _>>()?;
    scenes.iter().try_for_each(|scene| add_scene(storage, scene, devices))?;
    scenes.retain(|scene| is_asked(&scene.record.name));
    let late = measure(&scenes, devices, storage, watch)?;
    let wants_energies = !storage.record().run.quick && storage.record().labellings.is_empty() && !scenes.is_empty();
    if let Some(folder) = source.folder().filter(|_| wants_energies) {
        watch.tell(Event::Task("outside energies"));
        storage.record_mut().labellings = energies::compare(folder, &mut |_| watch.progress(1, 1))?;
    }
    let record = storage.record_mut();
    record.complete = record.cells.iter().all(|cell| cell.outcome != Outcome::Pending);
    storage.save()?;
    Ok(late)
}

/// Takes all samples. Each round covers all scenes, so that the samples of a cell spread over the whole run.
fn measure(
    scenes: &[Scene],
    devices: &[Asked],
    storage: &mut Storage,
    watch: &Watch<'_>,
) -> Result<Vec<String>, Failure> {
    let run = storage.record().run.clone();
    let rules = Rules { rounds: run.samples, slow_rounds: SLOW_ROUNDS, warm_up: false, fail_fast: false };
    let plans: Vec<_> = plans::all().into_iter().chain(plans::arranged()).collect();
    let storage = RefCell::new(storage);
    let mut entrants = Vec::new();
    for scene in scenes {
        for planned in &plans {
            for runner in Asked::opened(devices).filter(|runner| planned.suits(&runner.info)) {
                entrants.push(entrant(scene, planned, runner, &storage)?);
            }
        }
    }
    take_turns(&mut entrants, &rules, &mut Meter::new(watch))?;
    let late = |entrant: Entrant<InCell<'_>>| {
        let failure = entrant.failure.filter(|_| !entrant.samples.is_empty() && !entrant.contestant.disagrees)?;
        let InCell { scene, planned, runner, .. } = entrant.contestant;
        let (scene, plan, round) = (&scene.record.name, planned.name, entrant.samples.len() + 1);
        Some(format!("{scene}, {plan} on {}: round {round}: {failure}", runner.name))
    };
    Ok(entrants.into_iter().filter_map(late).collect())
}

/// Adds a scene and its cells to the record. If the record has the scene, checks that it is the same and resumes it.
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
    for planned in plans::all().into_iter().chain(plans::arranged()) {
        let plan = planned.plan(scene.pair.size(), run.labels, run.k)?;
        for Asked { name, runner } in devices {
            if runner.as_ref().is_ok_and(|runner| !planned.suits(&runner.info)) {
                continue;
            }
            let settings = match runner {
                Ok(runner) => runner.on_device(|device| Ok(settings(&planned, &plan, device)?))?,
                Err(_) => Settings::new(&plan, None, planned.algorithm),
            };
            cells.push(Cell {
                scene: scene.record.name.clone(),
                plan: planned.name.to_owned(),
                backend: name.clone(),
                device: runner.as_ref().ok().map(|runner| (&runner.info).into()),
                settings: Settings { k: planned.k(run.k), z: planned.z, ..settings },
                arrangement: planned.arrangement,
                outcome: runner.as_ref().map_or_else(|e| Outcome::Unavailable(e.clone()), |_| Outcome::Pending),
            });
        }
    }
    Ok(cells)
}

/// The settings and predictions of a plan on a device.
fn settings(planned: &Planned, plan: &Plan, device: &dyn Device) -> Result<Settings, Error> {
    let settings = Settings::new(plan, Some(device), planned.algorithm);
    let Some(parting) = planned.parting() else { return Ok(settings) };
    Ok(Settings { planned_bytes: Some(PartDriver::planned_bytes(device, plan, parting)?), ..settings })
}

/// A cell that takes turns. Each turn prepares the plan again, and each sample is saved at once.
struct InCell<'a> {
    scene: &'a Scene,
    planned: &'a Planned,
    plan: Plan,
    runner: &'a Runner,
    storage: &'a RefCell<&'a mut Storage>,
    /// Its index in the record.
    index: usize,
    /// The last turn's result, until it is saved.
    solved: Option<Solved>,
    /// Whether the labels differed from those of another run of the same plan.
    disagrees: bool,
}

/// The result of a turn.
struct Solved {
    labels: Vec<u16>,
    allocated_bytes: u64,
    labels_sha256: String,
}

/// The cell of a plan on a scene and a device, with the samples that it already has.
fn entrant<'a>(
    scene: &'a Scene,
    planned: &'a Planned,
    runner: &'a Runner,
    storage: &'a RefCell<&'a mut Storage>,
) -> Result<Entrant<InCell<'a>>, Failure> {
    let (name, plan) = (&scene.record.name, planned.name);
    let stored = storage.borrow();
    let record = stored.record();
    let is_it = |cell: &Cell| cell.scene == *name && cell.plan == plan && cell.backend == runner.name;
    let index = record.cells.iter().position(is_it);
    let index = index.ok_or_else(|| Failure::other(format!("{name}, {plan}: not in the record")))?;
    let samples = record.cells[index].measured().map_or(&[][..], |measured| &measured.samples);
    let shown = format!("{name:<11}{plan:<20}{:<8}", runner.name);
    let plan = planned.plan(scene.pair.size(), record.run.labels, record.run.k)?;
    Ok(Entrant::new(shown, InCell { scene, planned, plan, runner, storage, index, solved: None, disagrees: false })
        .resumed(samples))
}

impl Contestant for InCell<'_> {
    fn turn(&mut self, round: u32, meter: &Meter<'_>) -> Result<Sample, Failure> {
        let plan = self.plan.clone();
        let mut solve = Arranged::prepare(self.runner, plan, &self.scene.pair, self.planned.arrangement)?;
        let sample = solve.sample(round, meter)?;
        let Self { scene, planned, runner, .. } = self;
        let name = format!("{:<11}{:<20}{:<8}", scene.record.name, planned.name, runner.name);
        meter.line(&format!("{name}{:>10.1} ms", sample.total_ms));
        let bytes: Vec<u8> = solve.labels().iter().flat_map(|label| label.to_le_bytes()).collect();
        let labels_sha256 = hex(&Sha256::digest(bytes));
        self.check_labels(&labels_sha256)?;
        let (labels, allocated_bytes) = (solve.labels().to_vec(), solve.allocated_bytes());
        self.solved = Some(Solved { labels, allocated_bytes, labels_sha256 });
        Ok(sample)
    }

    fn keep(&mut self, taken: Result<&Sample, &Failure>) -> Result<(), Failure> {
        let mut storage = self.storage.borrow_mut();
        let cell = &storage.record().cells[self.index];
        let outcome = match (taken, self.solved.take()) {
            (Ok(sample), Some(solved)) => self.measured(cell, sample, solved, storage.folder())?,
            (Err(failure), _) if cell.measured().is_none() || self.disagrees => Outcome::failed(failure),
            _ => return Ok(()),
        };
        storage.record_mut().cells[self.index].outcome = outcome;
        storage.save()
    }

    fn entries(&self) -> u64 {
        self.plan.message_updates()
    }
}

impl InCell<'_> {
    /// Fails unless all samples on all devices give the same labels, in any arrangement.
    fn check_labels(&mut self, labels_sha256: &str) -> Result<(), Failure> {
        let storage = self.storage.borrow();
        let cells = &storage.record().cells;
        let cell = &cells[self.index];
        let unarranged = |cell: &Cell| Settings { planned_bytes: None, ..cell.settings.clone() };
        let same = |other: &&Cell| other.scene == cell.scene && unarranged(other) == unarranged(cell);
        let differs = |other: &&Cell| other.measured().is_some_and(|measured| measured.labels_sha256 != labels_sha256);
        let Some(other) = cells.iter().filter(same).find(differs) else { return Ok(()) };
        self.disagrees = true;
        Err(Failure::other(format!("other labels than an earlier run on {}", other.backend)))
    }

    /// The cell's measurement with one more sample. The first sample also provides energy, errors and disparity map.
    fn measured(&self, cell: &Cell, sample: &Sample, solved: Solved, folder: &Path) -> Result<Outcome, Failure> {
        let mut measurement = match cell.measured() {
            Some(measurement) => measurement.clone(),
            None => first_measurement(cell, self.scene, &self.plan, solved, folder)?,
        };
        measurement.samples.push(sample.clone());
        Ok(Outcome::Measured(Box::new(measurement)))
    }
}

/// The part of a measurement that is the same for every sample. Writes the disparity map.
fn first_measurement(
    cell: &Cell,
    scene: &Scene,
    plan: &Plan,
    solved: Solved,
    folder: &Path,
) -> Result<Measurement, Failure> {
    let disparities = DisparityMap::from_labels(plan.image_size(), plan.model(), &solved.labels)?;
    let errors = scene.truth.errors(&disparities)?;
    let visible = errors.visible.ok_or_else(|| Failure::other("a scene without visible pixels"))?;
    let map = format!("{}/{}-{}.png", record::MAPS_FOLDER, cell.scene, cell.plan);
    Raster::disparities(&disparities).write(&below(folder), &folder.join(&map))?;
    Ok(Measurement {
        samples: Vec::new(),
        allocated_bytes: solved.allocated_bytes,
        energy: Energy::of(&scene.pair, plan.model(), &solved.labels)?.into(),
        all: errors.all.into(),
        visible: visible.into(),
        labels_sha256: solved.labels_sha256,
        map,
    })
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::Ordering;

    use super::{super::storage, *};
    use crate::{
        backends::flaky::{self, Flaky},
        machine,
    };

    #[test]
    fn a_lost_device_is_opened_again_and_no_sample_is_lost_with_it() {
        let folder = tempfile::tempdir().unwrap();
        let source = Source::new(None, true).unwrap();
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
        let runner = Runner::of(flaky::open(backend).unwrap());
        let devices = [Asked { name: "flaky".to_owned(), runner: Ok(runner) }];
        let watch = Watch::default();
        let mut storage = storage::open(folder.path(), machine::machine(Some("test")), run, &watch).unwrap();
        let scene = source.load(0).unwrap();
        add_scene(&mut storage, &scene, &devices).unwrap();
        let late = measure(std::slice::from_ref(&scene), &devices, &mut storage, &watch).unwrap();
        // After each answer the device is lost: the next turn fails, and the turn after that opens it again.
        let cells = &storage.record().cells;
        let samples: Vec<_> =
            cells.iter().map(|cell| cell.measured().map_or(0, |measured| measured.samples.len())).collect();
        // A plan of four parts would need four answers.
        assert_eq!(samples, [2, 0, 1, 0, 2, 0, 1, 0, 2, 0, 1, 0, 0, 0, 0], "{late:?}");
        assert!(late.len() == 3 && late[0].contains("round 2: flaky did not answer within 60 s"), "{late:?}");
        assert!(matches!(cells[1].outcome, Outcome::Error(_)), "{:?}", cells[1].outcome);
        assert_eq!(backend.opened.load(Ordering::Relaxed), 12);
    }
}
