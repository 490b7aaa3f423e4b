//! `bp speed`: devices timed against each other on fixed problems, which need no files.

mod charts;
mod files;
mod problems;
mod run;
mod tables;

pub(crate) use files::{Files, is_record, renew};
pub(crate) use problems::Problem;
pub(crate) use run::{SpeedOptions, check, measure};
pub(crate) use tables::page;
