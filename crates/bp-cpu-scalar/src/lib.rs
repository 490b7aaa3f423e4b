//! The reference backend: one thread, textbook loops with the label loop innermost, written for readability.
//!
//! It is the baseline of all speed tables. Every other backend must compute bit-identical labels and messages.
//! Each kernel has its own file: `match_cost`, `coarsen`, `refine`, `update_messages` and `select_labels`. The files
//! `sweep`, `seams`, `decode` and `label_sets` hold the parts that differ under the schedule `sweep`. `grid` computes a message.

mod beliefs;
mod coarsen;
mod costs;
mod decode;
mod greys;
mod grid;
mod label_sets;
mod match_cost;
mod messages;
mod refine;
mod row;
mod seams;
mod select_labels;
mod solver;
mod sums;
mod sweep;
mod update_messages;

use bp_core::{Backend, Device, DeviceInfo, DeviceKind, Error, IsStopped, Plan, Schedule, Solver, memory};

/// The reference backend, which is also its only device.
#[derive(Clone, Copy, Debug, Default)]
pub struct Scalar;

impl Backend for Scalar {
    fn name(&self) -> &'static str {
        "scalar"
    }

    fn devices(&self) -> Vec<DeviceInfo> {
        let name = "CPU, 1 thread".to_owned();
        let kind = DeviceKind::Processor;
        vec![DeviceInfo { name, kind, api: None, driver: None, memory_bytes: None, uuid: None, workers: 1 }]
    }

    fn open(&self, device: usize) -> Result<Box<dyn Device>, Error> {
        if device > 0 {
            let reason = "the one device is 0".to_owned();
            return Err(Error::Unavailable { backend: self.name(), device, reason });
        }
        Ok(Box::new(Self))
    }
}

impl Device for Scalar {
    fn prepare(&self, plan: &Plan, is_stopped: IsStopped<'_>) -> Result<Box<dyn Solver>, Error> {
        Ok(Box::new(solver::ScalarSolver::new(plan, is_stopped)?))
    }

    /// Every edge has a slot for each direction, even under `sweep`, where it holds only one message at a time.
    fn planned_bytes(&self, plan: &Plan) -> u64 {
        let sweep = plan.settings().schedule == Schedule::Sweep;
        let messages = plan.buffers().into_iter().filter(|buffer| sweep && buffer.name == "messages");
        messages.fold(plan.bytes(), |bytes, buffer| bytes.saturating_add(buffer.bytes))
    }

    fn copy_rate(&self) -> Result<Option<f64>, Error> {
        memory::copy_rate(|from, to| to.copy_from_slice(from)).map(Some)
    }
}
