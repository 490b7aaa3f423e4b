//! What a gate measures, and where.

use std::path::PathBuf;

use super::{
    guarded::Guarded,
    measure::{Measured, Problem, measure},
    runners::Runners,
};
use bp_stereo::Watch;

use crate::{failure::Failure, record::Machine};

/// Which baselines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Renewal {
    /// The file for this kind of machine.
    Here,
    /// That and the file for all machines.
    Everywhere,
}

/// What is measured, and what it is held against.
#[derive(Debug)]
pub struct GateOptions {
    /// A smaller image and fewer loops.
    pub quick: bool,
    /// Rounds of a measurement.
    pub rounds: u32,
    /// The folder of the baselines.
    pub baselines: PathBuf,
    /// Baselines to write anew.
    pub update: Option<Renewal>,
}

/// What is measured, and where.
pub(super) struct Gate<'a> {
    pub(super) options: &'a GateOptions,
    pub(super) guarded: Vec<Guarded>,
    pub(super) problem: Problem,
    pub(super) runners: Runners,
    pub(super) machine: Machine,
}

impl Gate<'_> {
    pub(super) fn measure(&self, watch: &Watch<'_>) -> Result<Measured, Failure> {
        measure(&self.guarded, &self.runners, &self.problem, self.options.rounds, watch)
    }

    /// Which of a baseline's runs is like this one.
    pub(super) fn setting(&self) -> &'static str {
        if self.options.quick { "quick" } else { "full" }
    }
}
