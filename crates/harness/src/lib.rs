//! The experiments: the thesis's tables, speed, the gate.
//!
//! `reproduce` runs the thesis's experiments, `speed` times devices against each other, `gate` compares speed-ups with
//! committed baselines, and `cargo bench` runs `bench`. All measure with the one loop in `measure`; all but `gate`
//! write the records of `record`. `report`, `compare` and `export` make everything that people read from records alone.

mod backends;
pub mod bench;
pub mod compare;
pub mod escape;
pub mod export;
mod failure;
mod files;
#[cfg(feature = "fuzzing")]
pub mod fuzzing;
pub mod gate;
pub mod machine;
pub mod measure;
pub mod record;
pub mod report;
pub mod reproduce;
pub mod scenes;
pub mod speed;
mod statistics;
mod summary;
pub mod threads;

use std::path::{Path, PathBuf};

pub use failure::{Failure, Kind};

/// Writes the report of any recorded run again. Returns the path of its page.
///
/// # Errors
/// A message that names the file.
pub fn renew(run: &Path) -> Result<PathBuf, Failure> {
    if speed::is_record(run) { speed::renew(run) } else { report::renew(run) }
}
