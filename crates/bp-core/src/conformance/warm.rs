//! Frames of a video that start from the messages of the frame before.

use std::ops::ControlFlow;

use super::{Answer, Case, answer, assert_equal, noise_pair, solved};
use crate::{Algorithm, Cut, Device, Driver, Error, Model, Plan, Profile, Schedule, Settings, Size, StereoPair};

/// Frames from which each next one starts warm.
const FRAMES: u64 = 3;

/// Asserts that devices give the same labels and messages on a video, and that a device forgets it.
///
/// # Panics
/// Where they do not, or the tested one refuses the schedule `checkerboard` or an even number of steps.
pub(super) fn assert_same_warm(reference: &dyn Device, tested: &dyn Device) {
    for (plan, (width, height)) in plans() {
        let frames: Vec<StereoPair> = (0..FRAMES).map(|seed| noise_pair(width, height, seed)).collect();
        let of = |device| video(device, &plan, &frames);
        match (of(reference), of(tested)) {
            (Err(Error::Plan(_)), Err(Error::Plan(_))) if plan.settings().schedule == Schedule::Sweep => (),
            (Ok(_), Err(Error::Unsupported { .. })) if plan.settings().schedule == Schedule::Sync => {
                assert_eq!(plan.settings().steps % 2, 1, "refused: {plan:?}");
            }
            (Ok(expected), Ok(found)) => {
                for ((expected, found), pair) in expected.iter().zip(&found).zip(&frames) {
                    assert_equal(expected, found, &Case { pair: pair.clone(), plan: plan.clone() });
                }
                assert_forgets_video(tested, &plan, &frames);
            }
            (expected, found) => panic!("{:?} and {:?}\n{plan:?}", expected.err(), found.err()),
        }
    }
}

fn plans() -> impl Iterator<Item = (Plan, (usize, usize))> {
    let sizes = [(1, 1), (1, 4), (7, 1), (13, 11), (67, 40)];
    let all = sizes.into_iter().flat_map(|size| Schedule::ALL.map(|schedule| (size, schedule)));
    all.flat_map(|((width, height), schedule)| {
        let size = Size { width, height };
        let several = Settings { grids: 3, ..Algorithm::Cfbp.settings(size, 1, 1, schedule) };
        let cut = Some(Cut { x: width / 3, y: height / 2, seed_start: true });
        let shapes = [several, Settings { grids: 1, ..several }, Settings { grids: 1, cut, ..several }];
        let counted = shapes.into_iter().flat_map(|shape| [1, 2, 3, 4].map(|steps| Settings { steps, ..shape }));
        counted.filter_map(move |settings| {
            Some((Plan::new(size, Model::new(Profile::Census, 6).ok()?, settings).ok()?, (width, height)))
        })
    })
}

/// Answers to all frames, each but the first from a warm start.
fn video(device: &dyn Device, plan: &Plan, frames: &[StereoPair]) -> Result<Vec<Answer>, Error> {
    let mut driver = Driver::new(device, plan.clone())?;
    let mut solve = |pair: &StereoPair| {
        driver.solve_warm_observed(pair, &mut |_| ControlFlow::Continue(()))?;
        answer(&mut driver)
    };
    frames.iter().map(&mut solve).collect()
}

/// Asserts that a solve after a video, and a warm one after a solve that was stopped, are those of a fresh driver.
fn assert_forgets_video(device: &dyn Device, plan: &Plan, frames: &[StereoPair]) {
    let case = Case { pair: frames[0].clone(), plan: plan.clone() };
    let again = || -> Result<[Answer; 2], Error> {
        let mut driver = Driver::new(device, plan.clone())?;
        driver.solve(&frames[1])?;
        driver.solve_warm_observed(&frames[2], &mut |_| ControlFlow::Continue(()))?;
        driver.solve(&case.pair)?;
        let cold = answer(&mut driver)?;
        let stopped = driver.solve_warm_observed(&frames[1], &mut |_| ControlFlow::Break(()));
        assert_eq!(stopped, Err(Error::Stopped));
        driver.solve_warm_observed(&case.pair, &mut |_| ControlFlow::Continue(()))?;
        Ok([cold, answer(&mut driver)?])
    };
    let found = again().unwrap_or_else(|error| panic!("{error}\n{plan:?}"));
    let expected = solved(device, &case);
    found.iter().for_each(|found| assert_equal(&expected, found, &case));
}
