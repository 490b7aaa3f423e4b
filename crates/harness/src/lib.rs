//! The experiments: the thesis's tables, speed, the gate.
//!
//! `reproduce` runs the thesis's experiments, `speed` times devices against each other, `gate` holds speed-ups against
//! committed baselines, and `bench` is what `cargo bench` runs. All take their times by the one loop of `measure`, and write
//! the records of `record`. Everything that anybody looks at is made from a record alone: `report`, `compare` and `export`.

mod backends;
pub mod bench;
pub mod compare;
mod escape;
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

pub use failure::{Failure, Kind};
