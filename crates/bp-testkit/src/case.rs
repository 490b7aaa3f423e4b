//! A problem for a backend, and the backend's answer.

use std::ops::ControlFlow;

use bp_core::{Device, Driver, Error, Model, Plan, Settings, Side, Size, StereoPair};

/// A pair and a plan for it.
#[derive(Clone, Debug)]
pub struct Case {
    /// The pair.
    pub pair: StereoPair,
    /// The plan.
    pub plan: Plan,
}

impl Case {
    /// The pair with a plan of this model and these settings.
    ///
    /// # Errors
    /// Those of [`Plan::new`].
    pub fn new(pair: StereoPair, model: Model, settings: Settings) -> Result<Self, Error> {
        Ok(Self { plan: Plan::new(pair.size(), model, settings)?, pair })
    }

    /// The same plan for nodes that do not cover the first `margin` columns of the pair, but match them.
    ///
    /// # Errors
    /// Those of [`Plan::new`].
    pub(crate) fn behind(self, margin: usize) -> Result<Self, Error> {
        let Size { width, height } = self.pair.size();
        let size = Size { width: width.saturating_sub(margin), height };
        let plan = Plan::new(size, *self.plan.model(), *self.plan.settings())?.with_margin(margin)?;
        Ok(Self { plan, ..self })
    }
}

/// A backend's answer to a case.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Answer {
    /// Labels `[height][width]`.
    pub labels: Vec<u16>,
    /// The messages received from each of [`Side::ALL`], `[height][width][labels]`.
    pub messages: [Vec<u8>; 4],
}

impl Answer {
    /// The answer to the last solve of a driver.
    ///
    /// # Errors
    /// Those of the device.
    pub(crate) fn of(driver: &mut Driver) -> Result<Self, Error> {
        let [left, right, up, down] = Side::ALL;
        let messages = [driver.messages(left)?, driver.messages(right)?, driver.messages(up)?, driver.messages(down)?];
        Ok(Self { labels: driver.labels().to_vec(), messages })
    }
}

/// Solves a case on a device.
///
/// # Errors
/// Those of the device.
pub fn solve(device: &dyn Device, case: &Case) -> Result<Answer, Error> {
    let mut driver = Driver::new(device, case.plan.clone())?;
    driver.solve(&case.pair)?;
    Answer::of(&mut driver)
}

/// Solves a case at half the resolution. The answer has no messages.
///
/// # Errors
/// Those of the device.
pub(crate) fn solve_halved(device: &dyn Device, case: &Case) -> Result<Answer, Error> {
    let mut driver = Driver::new(device, case.plan.clone())?;
    driver.solve_halved_observed(&case.pair, &mut |_| ControlFlow::Continue(()))?;
    Ok(Answer { labels: driver.labels().to_vec(), messages: Default::default() })
}
