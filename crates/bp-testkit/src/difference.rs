//! How a device can fail the suite.

use std::fmt;

use bp_core::{Error, Plan, Side};

use crate::{Answer, Case};

/// Bytes of scratch memory that a device may allocate beyond its plan.
pub(crate) const SCRATCH_BYTES: u64 = 4096;

/// A device failed the suite: the fault, and the plan that shows it.
///
/// `Debug` prints the same words as `Display`, so that a test that returns a difference fails with them.
#[derive(Clone, PartialEq, Eq)]
pub struct Difference {
    /// The fault.
    pub fault: Box<Fault>,
    /// The plan that it ran.
    pub plan: Box<Plan>,
    /// The seed of [`random_case`](crate::random_case), if the case is a random one.
    pub seed: Option<u64>,
}

/// A fault of a device.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Fault {
    /// A message differs.
    #[error("message at ({x}, {y}) from {side:?}, label {label}: {found} instead of {expected}")]
    Message {
        /// Column of the node that received it.
        x: usize,
        /// Row of the node.
        y: usize,
        /// Where the sender lies.
        side: Side,
        /// The label whose entry differs.
        label: usize,
        /// The reference's entry.
        expected: u8,
        /// The tested device's entry.
        found: u8,
    },
    /// A label differs.
    #[error("label at ({x}, {y}): {found} instead of {expected}")]
    Label {
        /// Column of the pixel.
        x: usize,
        /// Row of the pixel.
        y: usize,
        /// The reference's label.
        expected: u16,
        /// The tested device's label.
        found: u16,
    },
    /// The device, or the reference, failed.
    #[error("{0}")]
    Failed(#[from] Error),
    /// Only one of two devices refused a plan, or they refused it for different reasons.
    #[error("{found:?} instead of {expected:?}")]
    Refusal {
        /// Why the reference refused it.
        expected: Option<Error>,
        /// Why the tested device refused it.
        found: Option<Error>,
    },
    /// A solve did not stop when its observer asked it to.
    #[error("a solve that should have stopped went on")]
    NotStopped,
    /// The device allocated more or less than it had planned.
    #[error("{allocated} bytes allocated, {planned} planned")]
    Memory {
        /// Bytes allocated.
        allocated: u64,
        /// Bytes planned.
        planned: u64,
    },
}

impl Difference {
    /// A fault that this plan showed.
    pub(crate) fn new(fault: Fault, plan: &Plan) -> Self {
        Self { fault: Box::new(fault), plan: Box::new(plan.clone()), seed: None }
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(seed) = self.seed {
            write!(f, "random_case({seed}): ")?;
        }
        write!(f, "{}\n{:?}", self.fault, self.plan)
    }
}

impl fmt::Debug for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl std::error::Error for Difference {}

/// Compares two answers to a case.
///
/// # Errors
/// The first message or label that differs.
pub(crate) fn same(expected: &Answer, found: &Answer, case: &Case) -> Result<(), Difference> {
    let message = Side::ALL.into_iter().find_map(|side| differing_message(expected, found, case, side));
    let fault = message.or_else(|| differing_label(expected, found, case));
    fault.map_or(Ok(()), |fault| Err(Difference::new(fault, &case.plan)))
}

fn differing_message(expected: &Answer, found: &Answer, case: &Case, side: Side) -> Option<Fault> {
    let [expected, found] = [expected, found].map(|answer| &answer.messages[side as usize]);
    let (width, labels) = (case.plan.image_size().width, case.plan.model().labels());
    let i = first_difference(expected, found)?;
    let (node, label) = (i / labels, i % labels);
    let (x, y) = (node % width, node / width);
    Some(Fault::Message { x, y, side, label, expected: expected[i], found: found[i] })
}

fn differing_label(expected: &Answer, found: &Answer, case: &Case) -> Option<Fault> {
    let width = case.plan.image_size().width;
    let i = first_difference(&expected.labels, &found.labels)?;
    Some(Fault::Label { x: i % width, y: i / width, expected: expected.labels[i], found: found.labels[i] })
}

fn first_difference<T: PartialEq>(expected: &[T], found: &[T]) -> Option<usize> {
    expected.iter().zip(found).position(|(a, b)| a != b)
}

#[cfg(test)]
mod tests {
    use bp_core::{Algorithm, Model, Profile, Schedule};

    use super::*;
    use crate::noise_pair;

    #[test]
    fn the_first_message_or_label_that_differs_is_named() {
        let pair = noise_pair(3, 2, 1);
        let settings = Algorithm::Bp.settings(pair.size(), 1, 1, Schedule::Sync);
        let case = Case::new(pair, Model::new(Profile::Census, 4).unwrap(), settings).unwrap();
        let expected = Answer { labels: vec![0; 6], messages: [const { Vec::new() }; 4].map(|_: Vec<u8>| vec![0; 24]) };
        assert_eq!(same(&expected, &expected, &case), Ok(()));
        let mut found = expected.clone();
        found.labels[4] = 3;
        let words = |found| same(&expected, &found, &case).unwrap_err().to_string();
        assert!(words(found.clone()).starts_with("label at (1, 1): 3 instead of 0\nPlan {"));
        found.messages[1][4 * 5 + 2] = 7;
        assert!(words(found).starts_with("message at (2, 1) from Right, label 2: 7 instead of 0\n"));
    }
}
