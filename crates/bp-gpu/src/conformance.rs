//! The tests that GPU backends share. They run the suite of [`bp_testkit`], also on devices with lowered limits, so that small
//! plans are split like large ones. They also check further rules for devices.
//!
//! `open` opens the backend's first device with changed limits, or returns `None` if there is none; see [`opened`].

use std::{env, thread, time::Duration};

use bp_core::{Algorithm, Device, Driver, Error, Model, Node, Plan, Profile, Schedule, Settings, StereoPair};
use bp_testkit::{Case, Difference, compare, compare_at_random, conform_every, noise_pair};

use crate::{Limits, Shape};

/// Returns the device, or prints why there is none and returns `None`.
///
/// # Panics
/// If there is no device although `BP_REQUIRE_GPU` is set in the environment.
#[must_use]
pub fn opened(device: Result<Box<dyn Device>, Error>) -> Option<Box<dyn Device>> {
    match device {
        Ok(device) => Some(device),
        Err(error) if env::var_os("BP_REQUIRE_GPU").is_none() => {
            eprintln!("skipped: {error}");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

/// Changes the shape of the kernels to that which suits other devices.
pub fn reshape(limits: &mut Limits) {
    limits.shape = match limits.shape {
        Shape::Words => Shape::Slices,
        Shape::Slices => Shape::Words,
    };
}

/// Runs every `n`-th case of the suite, and of 100 random ones.
///
/// # Errors
/// The first difference from the reference.
///
/// # Panics
/// If the device refuses a plan, or `n` is 0.
pub fn conforms(
    n: usize,
    reference: &dyn Device,
    open: impl Fn(&dyn Fn(&mut Limits)) -> Option<Box<dyn Device>>,
) -> Result<(), Difference> {
    let Some(device) = open(&|_| ()) else { return Ok(()) };
    conform_every(n, reference, device.as_ref())?;
    assert_eq!(compare_at_random(reference, &[device.as_ref()], (0..100).step_by(n))?, 0, "plans refused");
    Ok(())
}

/// Runs every algorithm under every schedule on an image of several bands, with several strips, dispatches of a few rows and
/// submissions of a few dispatches. Then runs random cases, each with the smallest buffers that suffice. Of both, only every
/// `n`-th case.
///
/// # Errors
/// The first difference from the reference.
///
/// # Panics
/// If the device refuses many plans, or `n` is 0.
pub fn conforms_cut_up(
    n: usize,
    reference: &dyn Device,
    open: impl Fn(&dyn Fn(&mut Limits)) -> Option<Box<dyn Device>>,
) -> Result<(), Difference> {
    let lowered = [16, 32, 64, 128, 512, 2048].map(|kib| {
        open(&|limits| {
            limits.binding_bytes = kib << 10;
            // As many workgroups as the widest image needs.
            (limits.workgroups, limits.dispatch_entries) = (18, 5000);
        })
    });
    let Some(devices) = lowered.into_iter().collect::<Option<Vec<_>>>() else { return Ok(()) };
    for (case, device) in banded_cases().iter().step_by(n).flat_map(|case| [(case, &devices[1]), (case, &devices[2])]) {
        compare(reference, device.as_ref(), case)?;
    }
    if let Some(device) = open(&|limits| limits.binding_bytes = COARSE_STRIP_BYTES) {
        coarse_strip_cases().iter().try_for_each(|case| compare(reference, device.as_ref(), case))?;
    }
    let devices: Vec<_> = devices.iter().map(Box::as_ref).collect();
    let refused = compare_at_random(reference, &devices, (1000..1100).step_by(n))?;
    assert!(refused <= 5, "{refused} plans refused");
    Ok(())
}

/// Runs sweeps over images that have several segments in a row and several bands: with label sets and without, with edges of one level
/// and of several.
///
/// # Errors
/// The first difference from the reference.
///
/// # Panics
/// If the device refuses a plan.
pub fn conforms_in_segments(
    reference: &dyn Device,
    open: impl Fn(&dyn Fn(&mut Limits)) -> Option<Box<dyn Device>>,
) -> Result<(), Difference> {
    let Some(device) = open(&|_| ()) else { return Ok(()) };
    segmented_cases().iter().try_for_each(|case| compare(reference, device.as_ref(), case))
}

fn segmented_cases() -> Vec<Case> {
    let sizes = [(96, 70), (97, 33), (231, 67)].map(|(width, height)| noise_pair(width, height, 3));
    let model = |profile| Model::new(profile, 35).expect("few labels");
    let models = [model(Profile::Census16), model(Profile::Census16).with_edges_halved_above(20), model(Profile::Mrf)];
    let cases = sizes.into_iter().flat_map(|pair| models.map(|model| (pair.clone(), model)));
    let plans =
        cases.flat_map(|(pair, model)| [(false, 1), (true, 1), (true, 2)].map(|rest| (pair.clone(), model, rest)));
    let case = |(pair, model, (label_sets, loops)): (StereoPair, Model, (bool, u32))| {
        let settings = Algorithm::Sweep.settings(pair.size(), loops, 1, Schedule::Sweep);
        let plan = Plan::new(pair.size(), model, Settings { label_sets, ..settings }).expect("a sweep");
        Case { pair, plan }
    };
    plans.map(case).collect()
}

fn banded_cases() -> Vec<Case> {
    let pair = noise_pair(21, 97, 3);
    let settings = Algorithm::ALL.into_iter().flat_map(|a| Schedule::ALL.map(|s| a.settings(pair.size(), 7, 2, s)));
    let plans = settings.flat_map(|settings| Profile::ALL.map(|profile| (profile, settings)));
    let plan = |(profile, settings)| Plan::new(pair.size(), Model::new(profile, 19).ok()?, settings).ok();
    plans.filter_map(plan).map(|plan| Case { pair: pair.clone(), plan }).collect()
}

/// Sweeps whose second grid is cut into strips too, if buffers hold [`COARSE_STRIP_BYTES`].
fn coarse_strip_cases() -> Vec<Case> {
    let pair = noise_pair(8, 97, 3);
    let sweep = Algorithm::Sweep.settings(pair.size(), 1, 1, Schedule::Sweep);
    let plan = |steps| Plan::new(pair.size(), Model::new(Profile::Census, 100).ok()?, Settings { steps, ..sweep }).ok();
    [1, 2].into_iter().filter_map(plan).map(|plan| Case { pair: pair.clone(), plan }).collect()
}

const COARSE_STRIP_BYTES: u64 = 32 << 10;

/// Runs several plans at the same time. They share the device's queue and kernels.
///
/// # Errors
/// The first difference from the reference.
///
/// # Panics
/// If a thread of the device panics.
pub fn runs_plans_at_once(
    reference: &dyn Device,
    open: impl Fn(&dyn Fn(&mut Limits)) -> Option<Box<dyn Device>>,
) -> Result<(), Difference> {
    let Some(device) = open(&|_| ()) else { return Ok(()) };
    let (cases, device) = (banded_cases(), device.as_ref());
    thread::scope(|scope| {
        let run = |cases: &[Case]| cases.iter().try_for_each(|case| compare(reference, device, case));
        let threads: Vec<_> = cases.chunks(18).map(|cases| scope.spawn(move || run(cases))).collect();
        threads.into_iter().try_for_each(|thread| thread.join().expect("no device panics"))
    })
}

/// Checks that plans beyond the limits fail with the right kind of error when they are prepared, and devices beyond
/// them when they are opened.
///
/// # Panics
/// If they do not.
pub fn refuses(open: impl Fn(&dyn Fn(&mut Limits)) -> Result<Box<dyn Device>, Error>) {
    let Some(plan) = banded_cases().pop().map(|case| case.plan) else { return };
    let prepare = |change: &dyn Fn(&mut Limits)| {
        opened(open(change)).map(|device| Driver::new(device.as_ref(), plan.clone()).err())
    };
    let small = prepare(&|limits| limits.binding_bytes = 4 << 10);
    assert!(matches!(small, None | Some(Some(Error::Unsupported { .. }))), "{small:?}");
    let settings =
        Settings { schedule: Schedule::Outward { start: Node { x: 0, y: 0 } }, grids: 1, ..*plan.settings() };
    let outward = Plan::new(plan.image_size(), *plan.model(), settings).expect("one grid, and a node inside");
    let refused = opened(open(&|_| ())).map(|device| Driver::new(device.as_ref(), outward).err());
    let says = |error: &Error| error.to_string().contains("the schedule outward runs on the backends scalar and rayon");
    assert!(refused.as_ref().is_none_or(|error| error.as_ref().is_some_and(says)), "{refused:?}");
    let little = prepare(&|limits| limits.memory_bytes = Some(1 << 16));
    assert!(matches!(little, None | Some(Some(Error::OutOfMemory { available: Some(65_536), .. }))), "{little:?}");
    let few = open(&|limits| limits.bindings = 4).err();
    assert!(matches!(few, Some(Error::Unavailable { .. })), "{few:?}");
}

/// Checks device times: the stages of a solve take more than a quarter of its total time on the host, and no more than
/// all of it.
///
/// # Panics
/// If they do not.
pub fn tells_times(open: impl Fn(&dyn Fn(&mut Limits)) -> Option<Box<dyn Device>>) {
    let Some(device) = open(&|_| ()) else { return };
    let pair = noise_pair(150, 100, 3);
    let settings = Algorithm::Bp.settings(pair.size(), 20, 1, Schedule::Sync);
    let plan = Model::new(Profile::Thesis, 64).and_then(|model| Plan::new(pair.size(), model, settings));
    let solve = |plan| {
        let mut driver = Driver::new(device.as_ref(), plan)?;
        driver.solve(&pair)?;
        driver.solve(&pair)
    };
    let times = plan.and_then(solve).unwrap_or_else(|error| panic!("{error}"));
    // A device may have no clock.
    let Some(stages) = times.device else { return };
    let sum: Duration = stages.iter().sum();
    assert!(sum <= times.total && 4 * sum > times.total, "{times:?}");
    assert!(stages[bp_core::Stage::UpdateMessages as usize] > sum / 4, "{times:?}");
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Program;

    #[test]
    fn two_grids_are_cut_into_strips() {
        let limits = Limits { binding_bytes: COARSE_STRIP_BYTES, ..Limits::roomy() };
        for case in coarse_strip_cases() {
            let program = Program::new(&case.plan, &limits).expect("it fits");
            let strips: Vec<_> = program.grids.iter().map(|grid| grid.strips.len()).collect();
            assert_eq!(strips, [2, 2, 1]);
        }
    }
}
