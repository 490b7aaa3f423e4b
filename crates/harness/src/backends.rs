//! Backends as the experiments open them.

mod asked;
#[cfg(test)]
pub(crate) mod flaky;

pub(crate) use asked::{Asked, open_all};
pub(crate) use bp_stereo::devices::{ALL, DEFAULT, Opened, choose, device_name, open, reason, reference};
