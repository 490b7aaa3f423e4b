//! This machine's memory and threads.

use bp_core::DeviceKind;
use rayon::{ThreadPool, ThreadPoolBuilder};
use sysinfo::{MemoryRefreshKind, ProcessRefreshKind, ProcessesToUpdate, RefreshKind, System};

use crate::Error;

/// Main memory in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Memory {
    /// The memory of the machine.
    pub total: u64,
    /// The memory that this process can still get.
    pub available: u64,
}

impl Memory {
    /// This machine's memory, if the system reports it.
    #[must_use]
    pub fn of_machine() -> Option<Self> {
        let what = RefreshKind::nothing().with_memory(MemoryRefreshKind::everything());
        let mut system = System::new_with_specifics(what).ok()?;
        let allowed = left_to_group(&mut system).unwrap_or(u64::MAX);
        Some(Self { total: system.total_memory(), available: system.available_memory().min(allowed) })
    }

    /// Bytes of this machine's memory that a device of this kind can get now. `None` if the system does not report
    /// them, or if the device has, or may have, memory of its own.
    #[must_use]
    pub fn available_to(kind: DeviceKind) -> Option<u64> {
        let shares = matches!(kind, DeviceKind::Processor | DeviceKind::IntegratedGpu | DeviceKind::SoftwareRasteriser);
        Self::of_machine().filter(|_| shares).map(|memory| memory.available)
    }
}

/// Bytes left to the control group of this process, such as a container or a cluster job. Cached files do not count as
/// used, since the system can drop them. `None` if there is no limit.
fn left_to_group(system: &mut System) -> Option<u64> {
    let own = sysinfo::get_current_pid().ok()?;
    system.refresh_processes_specifics(ProcessesToUpdate::Some(&[own]), false, ProcessRefreshKind::nothing());
    let limits = system.process(own)?.cgroup_limits()?;
    Some(limits.total_memory.saturating_sub(limits.rss))
}

/// A pool with this number of threads; `None` means RAYON_NUM_THREADS or, if that is not set, one per processor. The
/// backend `rayon` works in the pool that it is called in.
///
/// # Errors
/// [`Error::System`] if the threads cannot be started.
pub fn thread_pool(threads: Option<usize>) -> Result<ThreadPool, Error> {
    let failed = |error| Error::System(format!("cannot start the threads: {error}; fewer `threads` may do"));
    ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0)).build().map_err(failed)
}
