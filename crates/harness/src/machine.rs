//! This machine and this program, as records name them.

use std::{fs, io};

use bp_core::DeviceKind;

use sha2::{Digest, Sha256};
use sysinfo::{CpuRefreshKind, MemoryRefreshKind, ProcessRefreshKind, ProcessesToUpdate, RefreshKind, System};

use crate::{
    failure::Failure,
    files::hex,
    record::{Machine, Program},
};

/// The machine; `name` replaces the one made from the processor's.
pub(crate) fn machine(name: Option<&str>) -> Machine {
    let what = RefreshKind::nothing().with_cpu(CpuRefreshKind::nothing());
    // Where the system does not tell, the record says so rather than the run failing.
    let system = System::new_with_specifics(what).ok();
    let cpu = system.and_then(|system| Some(system.cpus().first()?.brand().trim().to_owned()));
    let cpu = cpu.unwrap_or_else(|| "unknown processor".to_owned());
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let name = name.map_or_else(|| slug(&format!("{cpu} {cores} cores")), slug);
    let system_name = System::long_os_version().unwrap_or_else(|_| std::env::consts::OS.to_owned());
    let memory_bytes = memory().map_or(0, |memory| memory.total);
    Machine { name, cpu, cores, memory_bytes, system: system_name }
}

/// The processor told apart from others that go by the same name, as rented ones do.
pub(crate) fn processor(machine: &Machine) -> String {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Some(id) = raw_cpuid::CpuId::new().get_feature_info() {
        return format!("{}, family {}, model {}", machine.cpu, id.family_id(), id.model_id());
    }
    machine.cpu.clone()
}

/// The kind of a machine: alike are those of one processor and as many cores.
pub(crate) fn kind(machine: &Machine) -> String {
    slug(&format!("{} {} cores", processor(machine), machine.cores))
}

/// Refuses what would not fit into [`available_memory`], before anything is allocated. Where that is not known,
/// allocating will.
pub(crate) fn check_memory(kind: DeviceKind, needed: u64, advice: &str) -> Result<(), Failure> {
    match available_memory(kind) {
        Some(available) if needed > available => {
            Err(Failure::out_of_memory(format!("{needed} bytes are needed and {available} available; {advice}")))
        }
        _ => Ok(()),
    }
}

/// Bytes of this machine's memory that a device of a kind can have now; `None` where the system does not tell, or the
/// device has, or may have, memory of its own.
pub(crate) fn available_memory(kind: DeviceKind) -> Option<u64> {
    let shares = matches!(kind, DeviceKind::Processor | DeviceKind::IntegratedGpu | DeviceKind::SoftwareRasteriser);
    memory().filter(|_| shares).map(|memory| memory.available)
}

/// Main memory in bytes.
pub(crate) struct Memory {
    pub(crate) total: u64,
    /// What this process can have now.
    pub(crate) available: u64,
}

/// This machine's memory, where the system tells.
pub(crate) fn memory() -> Option<Memory> {
    let what = RefreshKind::nothing().with_memory(MemoryRefreshKind::everything());
    let mut system = System::new_with_specifics(what).ok()?;
    let allowed = left_to_group(&mut system).unwrap_or(u64::MAX);
    Some(Memory { total: system.total_memory(), available: system.available_memory().min(allowed) })
}

/// Bytes that the control group of this process, a container or a cluster's job, has left: of what is used, files that are
/// cached do not count, as the system gives them up. `None` where there is no limit.
fn left_to_group(system: &mut System) -> Option<u64> {
    let own = sysinfo::get_current_pid().ok()?;
    system.refresh_processes_specifics(ProcessesToUpdate::Some(&[own]), false, ProcessRefreshKind::nothing());
    let limits = system.process(own)?.cgroup_limits()?;
    Some(limits.total_memory.saturating_sub(limits.rss))
}

/// The running program.
pub(crate) fn program() -> Result<Program, Failure> {
    let failed = |error: io::Error| Failure::other(format!("cannot read this program's own file: {error}"));
    let file = std::env::current_exe().and_then(fs::read).map_err(failed)?;
    Ok(Program {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        commit: env!("BP_COMMIT").to_owned(),
        clean_tree: env!("BP_CLEAN_TREE") == "true",
        sha256: hex(&Sha256::digest(file)),
        rustc: env!("BP_RUSTC").to_owned(),
        flags: env!("BP_FLAGS").to_owned(),
    })
}

/// The commit that the running program was built from, and whether with changes.
pub(crate) fn commit() -> String {
    let changes = if env!("BP_CLEAN_TREE") == "true" { "" } else { " with changes" };
    format!("{}{changes}", env!("BP_COMMIT"))
}

/// Lower-case letters, digits and single hyphens.
fn slug(text: &str) -> String {
    let parts = text.split(|c: char| !c.is_ascii_alphanumeric()).filter(|part| !part.is_empty());
    parts.map(str::to_lowercase).collect::<Vec<_>>().join("-")
}
