//! A self-test: a tiny problem with a known answer.

use bp_core::{Device, Driver, Error, Image, MessageStart, Model, Plan, Profile, Schedule, Settings, StereoPair};

/// Solves the pair of [`bp_core::worked_example`] on two grids and compares the labels with those given there. A device that
/// fails this test cannot be trusted with anything larger.
///
/// # Errors
/// The reason as text.
pub fn check(device: &dyn Device) -> Result<(), String> {
    let labels = solve(device).map_err(|error| format!("a tiny problem failed: {error}"))?;
    let expected = [0, 1, 1, 0, 1, 1];
    if labels == expected {
        return Ok(());
    }
    Err(format!(
        "it answered a tiny problem with the labels {labels:?} in place of {expected:?}: its driver is at fault"
    ))
}

fn solve(device: &dyn Device) -> Result<Vec<u16>, Error> {
    let left = Image::from_grey(3, 2, [40, 52, 60, 40, 45, 60])?;
    let right = Image::from_grey(3, 2, [52, 60, 61, 40, 60, 60])?;
    let pair = StereoPair::new(left, right)?;
    let (schedule, message_start) = (Schedule::Sync, MessageStart::Receiver);
    let settings =
        Settings { grids: 2, steps: 1, schedule, message_start, cut: None, coarse_clip: false, label_sets: false };
    let plan = Plan::new(pair.size(), Model::new(Profile::Thesis, 3)?, settings)?;
    let mut driver = Driver::new(device, plan)?;
    driver.solve(&pair)?;
    Ok(driver.labels().to_vec())
}
