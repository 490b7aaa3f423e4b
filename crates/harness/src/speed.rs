//! `bp speed` compares the speed of devices on fixed problems, which need no files.

mod charts;
mod files;
mod problems;
mod run;
mod tables;

pub use files::{Files, is_record, renew};
pub use problems::Problem;
pub use run::{SpeedOptions, check, measure};
pub use tables::page;
