//! The conditions of a measurement: how much of the machine other programs took, and how fast its caches copied.

use std::{hint::black_box, time::Instant};

use serde::Serialize;
use sysinfo::{CpuRefreshKind, Pid, ProcessRefreshKind, ProcessesToUpdate, RefreshKind, System};

use crate::statistics::median;

/// More cores than this, taken by others on average, disturb a measurement.
const OTHERS: f64 = 0.25;

/// Caches that copy slower than this fraction of their usual rate are shared with something else.
const SLOW_CACHE: f64 = 0.85;

/// Bytes of a copy, more than the cache of a core holds. The data costs and messages of a quick run are about as large.
const COPIED: usize = 8 << 20;

/// The copies before the rounds, and again after them, that the rate is a median of.
const COPIES: usize = 20;

/// Takes the conditions of a measurement from its beginning to its end.
pub(super) struct Observer {
    system: Option<System>,
    since: Instant,
    own_ms: u64,
    copies: Vec<f64>,
}

/// What a measurement's conditions were.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Conditions {
    /// Cores that other programs, or other machines of the same host, took on average; 0 where the system does not say.
    pub(super) others: f64,
    /// Bytes read and written per second, in 1e9, by one thread that copies [`COPIED`] bytes.
    pub(super) copy_gb_per_s: f64,
}

impl Observer {
    /// Begins.
    pub(super) fn begin() -> Self {
        let copies = copies();
        let what = RefreshKind::nothing().with_cpu(CpuRefreshKind::nothing().with_usage());
        let mut system = System::new_with_specifics(what).ok();
        let own_ms = system.as_mut().map_or(0, own_ms);
        Self { system, since: Instant::now(), own_ms, copies }
    }

    /// Ends.
    pub(super) fn end(mut self) -> Conditions {
        let seconds = self.since.elapsed().as_secs_f64();
        let others = self.system.as_mut().map_or(0.0, |system| {
            system.refresh_cpu_usage();
            let busy = f64::from(system.global_cpu_usage()) / 100.0 * system.cpus().len() as f64;
            (busy - own_ms(system).saturating_sub(self.own_ms) as f64 / 1000.0 / seconds).max(0.0)
        });
        self.copies.extend(copies());
        Conditions { others, copy_gb_per_s: median(self.copies).unwrap_or_default() }
    }
}

impl Conditions {
    /// Says what disturbed the measurement, if anything did. `usual` is the copy rate under which the baseline was
    /// measured.
    pub(super) fn disturbance(self, usual: Option<f64>) -> Option<String> {
        if self.others > OTHERS {
            return Some(format!("other programs took {:.1} cores", self.others));
        }
        let share = self.copy_gb_per_s / usual?;
        (share < SLOW_CACHE).then(|| format!("the caches copied at {:.0} % of the rate of the baseline", 100.0 * share))
    }
}

/// The CPU time of this process so far, in milliseconds.
fn own_ms(system: &mut System) -> u64 {
    let own = Pid::from_u32(std::process::id());
    let what = ProcessRefreshKind::nothing().with_cpu();
    system.refresh_processes_specifics(ProcessesToUpdate::Some(&[own]), false, what);
    system.process(own).map_or(0, sysinfo::Process::accumulated_cpu_time)
}

/// The rates of some copies.
fn copies() -> Vec<f64> {
    let (from, mut to) = (vec![1_u8; COPIED], vec![0; COPIED]);
    let mut copy = || {
        let start = Instant::now();
        black_box(&mut to).copy_from_slice(black_box(&from));
        2.0 * COPIED as f64 / 1e9 / start.elapsed().as_secs_f64().max(f64::MIN_POSITIVE)
    };
    (0..COPIES).map(|_| copy()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_that_takes_a_core_disturbs_and_a_slow_cache_does() {
        let calm = Conditions { others: 0.1, copy_gb_per_s: 20.0 };
        assert_eq!([calm.disturbance(None), calm.disturbance(Some(22.0))], [None, None]);
        assert!(Conditions { others: 0.9, ..calm }.disturbance(None).unwrap().contains("0.9 cores"));
        assert!(calm.disturbance(Some(40.0)).unwrap().contains("50 %"));
    }

    #[test]
    fn this_process_is_not_another_program() {
        let observer = Observer::begin();
        rayon::broadcast(|_| {
            let start = Instant::now();
            while start.elapsed().as_millis() < 500 {
                black_box(start);
            }
        });
        let (ended, cores) = (observer.end(), rayon::current_num_threads() as f64);
        assert!(ended.copy_gb_per_s > 0.0 && ended.others < 0.9 * cores, "{ended:?}");
    }
}
