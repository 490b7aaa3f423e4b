//! Videos, in which frames start from the messages of the frame before.

use std::ops::ControlFlow;

use bp_core::{
    Algorithm, Cut, Device, Driver, Error, Model, Node, Plan, Profile, Schedule, Settings, Size, StereoPair,
};

use crate::{Answer, Case, Difference, Fault, difference::same, noise_pair, solve};

/// Frames per video. All but the first start warm.
const FRAMES: u64 = 3;

/// Checks that devices give the same labels and messages on videos, and that no trace of them stays in the tested one.
///
/// # Errors
/// The first difference. The tested device may refuse only the schedule `sweep`, if the reference does too, and `sync`
/// with an odd number of steps.
pub(crate) fn compare_videos(reference: &dyn Device, tested: &dyn Device) -> Result<(), Difference> {
    plans(&Schedule::ALL).try_for_each(|plan| compare_video(reference, tested, plan))
}

/// The same under [`Schedule::Outward`].
///
/// # Errors
/// The first difference.
pub(crate) fn compare_outward_videos(reference: &dyn Device, tested: &dyn Device) -> Result<(), Difference> {
    let start = Node { x: 0, y: 0 };
    plans(&[Schedule::Outward { start }]).try_for_each(|plan| compare_video(reference, tested, plan))
}

fn compare_video(reference: &dyn Device, tested: &dyn Device, plan: Plan) -> Result<(), Difference> {
    let Size { width, height } = plan.image_size();
    let frames: Vec<StereoPair> = (0..FRAMES).map(|seed| noise_pair(width, height, seed)).collect();
    let schedule = plan.settings().schedule;
    match (video(reference, &plan, &frames), video(tested, &plan, &frames)) {
        (Err(Error::Plan(_)), Err(Error::Plan(_))) if schedule == Schedule::Sweep => Ok(()),
        (Ok(_), Err(Error::Unsupported { .. })) if schedule == Schedule::Sync && plan.settings().steps % 2 == 1 => {
            Ok(())
        }
        (Ok(expected), Ok(found)) => {
            for ((expected, found), pair) in expected.iter().zip(&found).zip(&frames) {
                same(expected, found, &Case { pair: pair.clone(), plan: plan.clone() })?;
            }
            let case = Case { pair: frames[frames.len() - 1].clone(), plan: plan.clone() };
            let unread = unread_video(tested, &plan, &frames).map_err(|error| Difference::new(error.into(), &plan))?;
            same(&expected[expected.len() - 1], &unread, &case)?;
            forgets(tested, &plan, &frames)
        }
        (expected, found) => {
            Err(Difference::new(Fault::Refusal { expected: expected.err(), found: found.err() }, &plan))
        }
    }
}

fn plans(schedules: &[Schedule]) -> impl Iterator<Item = Plan> {
    let sizes = [(1, 1), (1, 4), (7, 1), (13, 11), (67, 40)].map(|(width, height)| Size { width, height });
    let all = sizes.into_iter().flat_map(|size| schedules.iter().map(move |&schedule| (size, schedule)));
    all.flat_map(|(size, schedule)| {
        let several = Settings { grids: 3, ..Algorithm::Cfbp.settings(size, 1, 1, schedule) };
        let cut = Some(Cut { x: size.width / 3, y: size.height / 2, seed_start: true });
        let shapes = [several, Settings { grids: 1, ..several }, Settings { grids: 1, cut, ..several }];
        let counted = shapes.into_iter().flat_map(|shape| [1, 2, 3, 4].map(|steps| Settings { steps, ..shape }));
        counted.filter_map(move |settings| Plan::new(size, Model::new(Profile::Census, 6).ok()?, settings).ok())
    })
}

/// The answers to all frames. All but the first start warm.
fn video(device: &dyn Device, plan: &Plan, frames: &[StereoPair]) -> Result<Vec<Answer>, Error> {
    let mut driver = Driver::new(device, plan.clone())?;
    let mut solve = |pair: &StereoPair| {
        driver.solve_warm_observed(pair, &mut |_| ControlFlow::Continue(()))?;
        Answer::of(&mut driver)
    };
    frames.iter().map(&mut solve).collect()
}

/// The answer to the last frame, if no messages of earlier ones are read. Devices may keep only those that the next frame needs.
fn unread_video(device: &dyn Device, plan: &Plan, frames: &[StereoPair]) -> Result<Answer, Error> {
    let mut driver = Driver::new(device, plan.clone())?;
    for pair in frames {
        driver.solve_warm_observed(pair, &mut |_| ControlFlow::Continue(()))?;
    }
    Answer::of(&mut driver)
}

/// Checks that a cold solve after a video, and a warm one after a stopped solve, equal those of a fresh driver.
fn forgets(device: &dyn Device, plan: &Plan, frames: &[StereoPair]) -> Result<(), Difference> {
    let case = Case { pair: frames[0].clone(), plan: plan.clone() };
    let [other, last] = [&frames[1], &frames[2]];
    let again = || -> Result<[Answer; 2], Fault> {
        let mut driver = Driver::new(device, plan.clone())?;
        driver.solve(other)?;
        driver.solve_warm_observed(last, &mut |_| ControlFlow::Continue(()))?;
        driver.solve(&case.pair)?;
        let cold = Answer::of(&mut driver)?;
        let stopped = driver.solve_warm_observed(other, &mut |_| ControlFlow::Break(()));
        if stopped != Err(Error::Stopped) {
            return Err(Fault::NotStopped);
        }
        driver.solve_warm_observed(&case.pair, &mut |_| ControlFlow::Continue(()))?;
        Ok([cold, Answer::of(&mut driver)?])
    };
    let found = again().map_err(|fault| Difference::new(fault, plan))?;
    let expected = solve(device, &case).map_err(|error| Difference::new(error.into(), plan))?;
    found.iter().try_for_each(|found| same(&expected, found, &case))
}
