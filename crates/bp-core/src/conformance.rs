//! The suite that every backend passes: labels and messages equal to the bit, on every kind of plan.
//!
//! A backend's own test opens its device and calls [`assert_conforms`], against [`Oracle`] or a device that is itself
//! held against it.

mod cases;
mod oracle;
mod random;
mod warm;

pub use cases::{cases, noise_pair};
pub use oracle::Oracle;
pub use random::random_case;

use std::ops::ControlFlow;

use crate::{Algorithm, Device, Driver, Error, Model, Plan, Profile, Schedule, Side, StereoPair};

/// A pair and a plan for it.
#[derive(Clone, Debug)]
pub struct Case {
    /// The pair.
    pub pair: StereoPair,
    /// The plan.
    pub plan: Plan,
}

/// What a backend answered: labels `[height][width]`, and what was received from each of [`Side::ALL`],
/// `[height][width][labels]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Answer {
    /// Labels.
    pub labels: Vec<u16>,
    /// Messages.
    pub messages: [Vec<u8>; 4],
}

/// Solves a case.
///
/// # Errors
/// Those of the device.
pub fn solve(device: &dyn Device, case: &Case) -> Result<Answer, Error> {
    let mut driver = Driver::new(device, case.plan.clone())?;
    driver.solve(&case.pair)?;
    answer(&mut driver)
}

fn answer(driver: &mut Driver) -> Result<Answer, Error> {
    let [left, right, up, down] = Side::ALL;
    let messages = [driver.messages(left)?, driver.messages(right)?, driver.messages(up)?, driver.messages(down)?];
    Ok(Answer { labels: driver.labels().to_vec(), messages })
}

/// The whole suite.
///
/// # Panics
/// Where the tested device fails any of it.
pub fn assert_conforms(reference: &dyn Device, tested: &dyn Device) {
    cases().for_each(|case| assert_same(reference, tested, &case));
    warm::assert_same_warm(reference, tested);
    for (algorithm, schedule) in Algorithm::ALL.into_iter().flat_map(|a| Schedule::ALL.map(|s| (a, s))) {
        for profile in Profile::ALL {
            // One loop: what an old message leaves behind is not yet washed out.
            let pair = noise_pair(21, 17, 1);
            let model = Model::new(profile, 9);
            let plan = model.and_then(|m| Plan::new(pair.size(), m, algorithm.settings(pair.size(), 1, 1, schedule)));
            let case = Case { plan: plan.unwrap_or_else(|error| panic!("{error}")), pair };
            assert_forgets(tested, &case);
            assert_memory_as_planned(tested, &case.plan);
        }
    }
}

/// Asserts that two devices give the same labels and messages on a case.
///
/// # Panics
/// Where one fails, or they differ; the message names the case and the first node that differs.
pub fn assert_same(reference: &dyn Device, tested: &dyn Device, case: &Case) {
    assert_equal(&solved(reference, case), &solved(tested, case), case);
}

/// Asserts that devices give the same labels and messages on the random cases of these seeds, each on the first of the
/// `tested` devices that does not refuse it as [`Error::Unsupported`]: from the smallest to the largest, say. Tells how
/// many cases all of them refuse.
///
/// # Panics
/// Where one fails otherwise, or they differ; the message names the seed, the plan and the first node that differs.
pub fn assert_same_at_random(
    reference: &dyn Device,
    tested: &[&dyn Device],
    seeds: impl IntoIterator<Item = u64>,
) -> usize {
    let runs = |&seed: &u64| {
        let case = random_case(seed);
        let is_refused = |found: &Result<Answer, Error>| matches!(found, Err(Error::Unsupported { .. }));
        let Some(found) = tested.iter().map(|device| solve(*device, &case)).find(|found| !is_refused(found)) else {
            return false;
        };
        let differ = |found: Answer| Ok(difference(&solve(reference, &case)?, &found, &case));
        if let Some(what) = found.and_then(differ).unwrap_or_else(|error| Some(error.to_string())) {
            panic!("random_case({seed}): {what}\n{:?}", case.plan);
        }
        true
    };
    seeds.into_iter().filter(|seed| !runs(seed)).count()
}

fn solved(device: &dyn Device, case: &Case) -> Answer {
    solve(device, case).unwrap_or_else(|error| panic!("{error}\n{:?}", case.plan))
}

fn assert_equal(expected: &Answer, found: &Answer, case: &Case) {
    if let Some(difference) = difference(expected, found, case) {
        panic!("{difference}\n{:?}", case.plan);
    }
}

/// The first node where two answers differ, in words.
fn difference(expected: &Answer, found: &Answer, case: &Case) -> Option<String> {
    let (width, labels) = (case.pair.size().width, case.plan.model().labels());
    for ((expected, found), side) in expected.messages.iter().zip(&found.messages).zip(Side::ALL) {
        if let Some(i) = first_difference(expected, found) {
            let (node, label) = (i / labels, i % labels);
            let place = format!("({}, {}) from {side:?}, label {label}", node % width, node / width);
            return Some(format!("message at {place}: {} instead of {}", found[i], expected[i]));
        }
    }
    let i = first_difference(&expected.labels, &found.labels)?;
    let (expected, found) = (expected.labels[i], found.labels[i]);
    Some(format!("label at ({}, {}): {found} instead of {expected}", i % width, i / width))
}

/// Asserts that a driver answers as a fresh one does, after another pair and after a solve that was stopped.
fn assert_forgets(device: &dyn Device, case: &Case) {
    let expected = solved(device, case);
    let other = noise_pair(case.pair.size().width, case.pair.size().height, 2);
    let again = || -> Result<[Answer; 2], Error> {
        let mut driver = Driver::new(device, case.plan.clone())?;
        driver.solve(&other)?;
        driver.solve(&case.pair)?;
        let reused = answer(&mut driver)?;
        let stopped = driver.solve_observed(&other, &mut |_| ControlFlow::Break(()));
        assert_eq!(stopped, Err(Error::Stopped));
        driver.solve(&case.pair)?;
        Ok([reused, answer(&mut driver)?])
    };
    let found = again().unwrap_or_else(|error| panic!("{error}\n{:?}", case.plan));
    found.iter().for_each(|found| assert_equal(&expected, found, case));
}

/// Asserts that what is allocated is what was planned, but for a few kilobytes of scratch.
fn assert_memory_as_planned(device: &dyn Device, plan: &Plan) {
    let driver = Driver::new(device, plan.clone()).unwrap_or_else(|error| panic!("{error}\n{plan:?}"));
    let (planned, allocated) = (device.planned_bytes(plan), driver.allocated_bytes());
    assert!(allocated.abs_diff(planned) <= 4096, "{allocated} bytes allocated, {planned} planned\n{plan:?}");
}

fn first_difference<T: PartialEq>(expected: &[T], found: &[T]) -> Option<usize> {
    assert_eq!(expected.len(), found.len());
    expected.iter().zip(found).position(|(a, b)| a != b)
}
