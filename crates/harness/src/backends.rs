//! Backends as the experiments open them.

#[cfg(test)]
pub(crate) mod flaky;

pub(crate) use bp_stereo::devices::{ALL, Opened, choose, reason, reference};
