//! The fast CPU backend. It computes vectors of pixels, distributes work over threads with rayon, and updates messages
//! in place while they are in cache. Its labels and messages are bit-identical to those of the scalar backend, on every
//! instruction set and with any number of threads.
//!
//! Its devices are the instruction sets of this CPU, the widest first. Work runs on the current rayon pool; use
//! [`rayon::ThreadPool::install`] to run it on your own pool. The schedule `sweep` needs memory for every thread, so
//! prepare a plan, and predict its memory, on the pool that solves it.
//!
//! Where to start reading:
//!
//! * `shape` and `block` explain how the values of a grid lie in memory, `layout` and `greys` which edges exist and what level they have.
//! * `match_cost` (on `features` and `compare`) and `coarsen` compute data costs.
//! * `half_steps` runs the schedules `sync` and `checkerboard` over whole grids. Its `edges` explains why one message per edge
//!   is enough.
//! * `sweep` runs the schedule of that name over one band of rows at a time, whose blocks have lists of labels of their own.
//! * Both have the kernels `refine` and those that send messages and select labels. Each file begins with the loop of the
//!   scalar version or with what differs from it.

mod block;
mod coarsen;
mod compare;
mod costs;
mod features;
mod greys;
mod half_steps;
mod layout;
mod match_cost;
mod shape;
mod solver;
mod stored;
mod sweep;

use bp_core::{Backend, Device, DeviceInfo, DeviceKind, Error, IsStopped, Plan, Solver, memory};
use fearless_simd::Level;
use rayon::prelude::*;

/// The fast CPU backend.
#[derive(Clone, Copy, Debug, Default)]
pub struct Rayon;

/// The instruction sets of this CPU and their names, the widest first.
fn levels() -> Vec<(Level, &'static str)> {
    let best = Level::new();
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    let levels = [
        best.as_avx512().map(|level| (Level::Avx512(level), "AVX-512")),
        best.as_avx2().map(|level| (Level::Avx2(level), "AVX2")),
        best.as_sse4_2().map(|level| (Level::Sse4_2(level), "SSE4.2")),
        best.as_sse2().map(|level| (Level::Sse2(level), "SSE2")),
    ];
    #[cfg(target_arch = "aarch64")]
    let levels = [best.as_neon().map(|level| (Level::Neon(level), "NEON"))];
    #[cfg(not(any(target_arch = "x86", target_arch = "x86_64", target_arch = "aarch64")))]
    let levels = [Some((best, "baseline"))];
    levels.into_iter().flatten().collect()
}

impl Backend for Rayon {
    fn name(&self) -> &'static str {
        "rayon"
    }

    fn devices(&self) -> Vec<DeviceInfo> {
        let workers = rayon::current_num_threads();
        let threads = if workers == 1 { "1 thread".to_owned() } else { format!("{workers} threads") };
        let info = |(_, name)| DeviceInfo {
            name: format!("CPU, {name}, {threads}"),
            kind: DeviceKind::Processor,
            api: None,
            driver: None,
            memory_bytes: None,
            uuid: None,
            workers,
        };
        levels().into_iter().map(info).collect()
    }

    fn open(&self, device: usize) -> Result<Box<dyn Device>, Error> {
        let levels = levels();
        match levels.get(device) {
            Some(&(level, _)) => Ok(Box::new(RayonDevice { level })),
            None => {
                let reason = format!("this processor has {} instruction sets, numbered from 0", levels.len());
                Err(Error::Unavailable { backend: self.name(), device, reason })
            }
        }
    }
}

/// One instruction set.
struct RayonDevice {
    level: Level,
}

impl Device for RayonDevice {
    fn prepare(&self, plan: &Plan, is_stopped: IsStopped<'_>) -> Result<Box<dyn Solver>, Error> {
        Ok(Box::new(solver::RayonSolver::new(self.level, plan, is_stopped)?))
    }

    fn planned_bytes(&self, plan: &Plan) -> u64 {
        solver::planned_bytes(plan)
    }

    fn likely_bytes(&self, plan: &Plan) -> u64 {
        solver::likely_bytes(plan)
    }

    fn copy_rate(&self) -> Result<Option<f64>, Error> {
        let threads = rayon::current_num_threads();
        let copy = |from: &[u8], to: &mut [u8]| {
            let part = from.len().div_ceil(threads);
            to.par_chunks_mut(part).zip(from.par_chunks(part)).for_each(|(to, from)| to.copy_from_slice(from));
        };
        memory::copy_rate(copy).map(Some)
    }
}
