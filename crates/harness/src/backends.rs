//! Backends as the experiments open them.

#[cfg(test)]
pub mod flaky;

pub use bp_stereo::devices::{ALL, DEFAULT, Opened, choose, device_name, reason, reference};
