//! The suite that every backend passes: bit-identical labels and messages on every kind of plan.

use std::ops::ControlFlow;

use bp_core::{Algorithm, Device, Driver, Error, Model, Plan, Profile, Schedule, Settings};

use crate::{
    Answer, Case, Difference, Fault,
    case::solve_halved,
    cases,
    cases::outward_cases,
    difference::{SCRATCH_BYTES, same},
    noise_pair,
    parts::compare_parts,
    random_case, solve,
    videos::{compare_outward_videos, compare_videos},
};

/// Runs the whole suite on the `tested` device.
///
/// # Errors
/// The first difference.
pub fn conform(reference: &dyn Device, tested: &dyn Device) -> Result<(), Difference> {
    conform_every(1, reference, tested)
}

/// Runs the suite with every `n`-th case only, for a backend that shares its kernels with one that runs all of them.
///
/// # Errors
/// The first difference.
///
/// # Panics
/// If `n` is 0.
pub fn conform_every(n: usize, reference: &dyn Device, tested: &dyn Device) -> Result<(), Difference> {
    cases().step_by(n).try_for_each(|case| compare(reference, tested, &case))?;
    compare_videos(reference, tested)?;
    compare_parts(reference, tested)?;
    short_cases().try_for_each(|case| {
        forgets(tested, &case)?;
        allocates_as_planned(tested, &case.plan)
    })
}

/// Runs a suite for the experiment [`Schedule::Outward`], which only some backends have.
///
/// # Errors
/// The first difference.
pub fn conform_outward(reference: &dyn Device, tested: &dyn Device) -> Result<(), Difference> {
    outward_cases().try_for_each(|case| compare(reference, tested, &case))?;
    compare_outward_videos(reference, tested)?;
    outward_cases().step_by(37).try_for_each(|case| forgets(tested, &case))?;
    outward_cases().step_by(37).try_for_each(|case| allocates_as_planned(tested, &case.plan))
}

/// Checks that two devices give the same labels and messages for a case.
///
/// # Errors
/// The first difference, or the error of a device that failed.
pub fn compare(reference: &dyn Device, tested: &dyn Device, case: &Case) -> Result<(), Difference> {
    let failed = |error: Error| Difference::new(error.into(), &case.plan);
    let expected = solve(reference, case).map_err(failed)?;
    same(&expected, &solve(tested, case).map_err(failed)?, case)?;
    if case.plan.halved() == 0 {
        return Ok(());
    }
    let halved = |device| solve_halved(device, case).map_err(failed);
    same(&halved(reference)?, &halved(tested)?, case)
}

/// Checks that devices give the reference's labels and messages for the random cases of these seeds. Each case runs on
/// the first of the `tested` devices that does not refuse it as [`Error::Unsupported`], so list the smallest first.
/// Returns the number of cases that all of them refuse.
///
/// # Errors
/// The first difference, or the error of a device that failed otherwise.
pub fn compare_at_random(
    reference: &dyn Device,
    tested: &[&dyn Device],
    seeds: impl IntoIterator<Item = u64>,
) -> Result<usize, Difference> {
    let mut refused = 0;
    for seed in seeds {
        let case = random_case(seed);
        let seeded = |difference| Difference { seed: Some(seed), ..difference };
        let is_refused = |found: &Result<Answer, Error>| matches!(found, Err(Error::Unsupported { .. }));
        let answers = tested.iter().map(|device| solve(*device, &case));
        match answers.into_iter().find(|found| !is_refused(found)) {
            Some(found) => compare_answer(reference, found, &case).map_err(seeded)?,
            None => refused += 1,
        }
    }
    Ok(refused)
}

fn compare_answer(reference: &dyn Device, found: Result<Answer, Error>, case: &Case) -> Result<(), Difference> {
    let failed = |error: Error| Difference::new(error.into(), &case.plan);
    let found = found.map_err(failed)?;
    same(&solve(reference, case).map_err(failed)?, &found, case)
}

/// Sweeps with seams, and every algorithm, schedule and profile with one loop, so that traces of old messages are not yet
/// washed out.
fn short_cases() -> impl Iterator<Item = Case> {
    let pair = noise_pair(21, 17, 1);
    let seams = noise_pair(21, 70, 1);
    let sweep = Algorithm::Sweep.settings(seams.size(), 1, 1, Schedule::Sweep);
    let swept =
        [(3, 1), (1, 2)].map(|(grids, steps)| Settings { grids, steps, ..sweep }).into_iter().map(move |settings| {
            let case = Model::new(Profile::Census, 70).and_then(|model| Case::new(seams.clone(), model, settings));
            case.unwrap_or_else(|error| panic!("{error}"))
        });
    let schedules = Algorithm::ALL.into_iter().flat_map(|a| Schedule::ALL.map(|schedule| (a, schedule)));
    let all = schedules.flat_map(|(a, schedule)| Profile::ALL.map(|profile| (a, schedule, profile)));
    let all = all.map(move |(algorithm, schedule, profile)| {
        let settings = algorithm.settings(pair.size(), 1, 1, schedule);
        let case = Model::new(profile, 9).and_then(|model| Case::new(pair.clone(), model, settings));
        case.unwrap_or_else(|error| panic!("{error}"))
    });
    swept.chain(all)
}

/// Checks that a driver answers like a fresh one after another pair, after a stopped solve, and after one at half the resolution.
fn forgets(device: &dyn Device, case: &Case) -> Result<(), Difference> {
    let other = noise_pair(case.pair.size().width, case.pair.size().height, 2);
    let again = || -> Result<[Answer; 3], Fault> {
        let mut driver = Driver::new(device, case.plan.clone())?;
        driver.solve(&other)?;
        driver.solve(&case.pair)?;
        let reused = Answer::of(&mut driver)?;
        let stopped = driver.solve_observed(&other, &mut |_| ControlFlow::Break(()));
        if stopped != Err(Error::Stopped) {
            return Err(Fault::NotStopped);
        }
        driver.solve(&case.pair)?;
        let after_stop = Answer::of(&mut driver)?;
        driver.solve_halved_observed(&other, &mut |_| ControlFlow::Continue(()))?;
        driver.solve(&case.pair)?;
        Ok([reused, after_stop, Answer::of(&mut driver)?])
    };
    let expected = solve(device, case).map_err(|error| Difference::new(error.into(), &case.plan))?;
    let found = again().map_err(|fault| Difference::new(fault, &case.plan))?;
    found.iter().try_for_each(|found| same(&expected, found, case))
}

/// Checks that a device allocates what it planned, apart from some scratch memory.
fn allocates_as_planned(device: &dyn Device, plan: &Plan) -> Result<(), Difference> {
    let driver = Driver::new(device, plan.clone()).map_err(|error| Difference::new(error.into(), plan))?;
    let (planned, allocated) = (device.planned_bytes(plan), driver.allocated_bytes());
    if allocated.abs_diff(planned) > SCRATCH_BYTES {
        return Err(Difference::new(Fault::Memory { allocated, planned }, plan));
    }
    Ok(())
}
