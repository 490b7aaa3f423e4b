//! This machine and this program, as records describe them.

use std::io;

use bp_core::DeviceKind;
use bp_io::Contents;
use bp_stereo::Memory;
use bytesize::ByteSize;

use sha2::{Digest, Sha256};
use sysinfo::{CpuRefreshKind, RefreshKind, System};

use crate::{
    failure::Failure,
    files::hex,
    record::{Machine, Program},
};

/// Describes the machine. `name` replaces the default name, which is made from the CPU's.
pub fn machine(name: Option<&str>) -> Machine {
    let what = RefreshKind::nothing().with_cpu(CpuRefreshKind::nothing());
    // If the system does not name its CPU, the record says so and the run goes on.
    let system = System::new_with_specifics(what).ok();
    let cpu = system.and_then(|system| Some(system.cpus().first()?.brand().trim().to_owned()));
    let cpu = cpu.unwrap_or_else(|| "unknown processor".to_owned());
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let name = name.map_or_else(|| slug(&format!("{cpu} {cores} cores")), slug);
    let system_name = System::long_os_version().unwrap_or_else(|_| std::env::consts::OS.to_owned());
    let memory_bytes = Memory::of_machine().map_or(0, |memory| memory.total);
    Machine { name, cpu, cores, memory_bytes, system: system_name }
}

/// The CPU with family and model, since different CPUs of rented machines may share a name.
pub fn processor(machine: &Machine) -> String {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Some(id) = raw_cpuid::CpuId::new().get_feature_info() {
        return format!("{}, family {}, model {}", machine.cpu, id.family_id(), id.model_id());
    }
    machine.cpu.clone()
}

/// The kind of a machine. Machines with the same CPU and number of cores are of the same kind.
pub fn kind(machine: &Machine) -> String {
    slug(&format!("{} {} cores", processor(machine), machine.cores))
}

/// Fails, before anything is allocated, if `needed` bytes exceed the memory now available to the device. If that is not
/// known, the allocation itself will fail.
pub fn check_memory(kind: DeviceKind, needed: u64, advice: &str) -> Result<(), Failure> {
    let iec = |bytes| ByteSize(bytes).display().iec();
    match Memory::available_to(kind) {
        Some(free) if needed > free => {
            let what = format!("needs {}, but only {} is available; {advice}", iec(needed), iec(free));
            Err(Failure::out_of_memory(what))
        }
        _ => Ok(()),
    }
}

/// The running program.
pub fn program() -> Result<Program, Failure> {
    let failed = |error: io::Error| Failure::other(format!("cannot find this program's own file: {error}"));
    let file = Contents::of(&std::env::current_exe().map_err(failed)?, u64::MAX)?.bytes;
    Ok(Program {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        commit: env!("BP_COMMIT").to_owned(),
        clean_tree: env!("BP_CLEAN_TREE") == "true",
        sha256: hex(&Sha256::digest(file)),
        rustc: env!("BP_RUSTC").to_owned(),
        flags: env!("BP_FLAGS").to_owned(),
    })
}

/// The commit that the running program was built from, and whether the sources had changes.
pub fn commit() -> String {
    let changes = if env!("BP_CLEAN_TREE") == "true" { "" } else { " with changes" };
    format!("{}{changes}", env!("BP_COMMIT"))
}

/// Lower-case letters, digits and single hyphens.
fn slug(text: &str) -> String {
    let parts = text.split(|c: char| !c.is_ascii_alphanumeric()).filter(|part| !part.is_empty());
    parts.map(str::to_lowercase).collect::<Vec<_>>().join("-")
}
