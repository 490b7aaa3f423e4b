//! What a gate measures, and where.

use std::path::PathBuf;

use super::{
    guarded::Guarded,
    measure::{Measured, Problem, measure},
    runners::Runners,
};
use bp_stereo::Watch;

use crate::{failure::Failure, record::Machine};

/// Which baselines to renew.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Renewal {
    /// The file for this kind of machine.
    Here,
    /// The file for this kind of machine and the file for all machines.
    Everywhere,
}

/// How to measure, and which baselines to compare with.
#[derive(Debug)]
pub struct GateOptions {
    /// A smaller image and fewer iterations.
    pub quick: bool,
    /// Rounds of a measurement.
    pub rounds: u32,
    /// The folder of the baselines.
    pub baselines: PathBuf,
    /// Baselines to renew, if any.
    pub update: Option<Renewal>,
    /// Folder for a first baseline of this kind of machine, made of this measurement if nothing fails.
    pub proposal: Option<PathBuf>,
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

    /// The name in a baseline of runs with these settings.
    pub(super) fn setting(&self) -> &'static str {
        if self.options.quick { "quick" } else { "full" }
    }
}
