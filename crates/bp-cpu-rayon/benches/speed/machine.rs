//! The machine and the program, as the report names them.

use std::process::Command;

use serde::Serialize;
use sysinfo::{CpuRefreshKind, MemoryRefreshKind, RefreshKind, System};

use crate::solve::instruction_sets;

/// Where and with what was measured.
#[derive(Serialize)]
pub(crate) struct Machine {
    /// The processor.
    pub(crate) cpu: String,
    /// Cores that this process may use.
    pub(crate) cores: usize,
    /// Of the machine.
    pub(crate) memory_bytes: u64,
    /// The operating system.
    pub(crate) system: String,
    /// Instruction sets that kernels exist for, the widest first; what is not said to use another uses the first.
    pub(crate) instruction_sets: Vec<String>,
    /// The compiler.
    pub(crate) rustc: String,
    /// The revision.
    pub(crate) commit: String,
    /// Whether the working tree was that revision's.
    pub(crate) clean_tree: bool,
    /// When, in UTC.
    pub(crate) date: String,
    /// How many times as much arithmetic as one thread two threads did before and after the groups: 2 where both had a
    /// core for themselves.
    pub(crate) two_threads: Vec<f64>,
}

impl Machine {
    /// This one.
    pub(crate) fn here() -> Self {
        let what = RefreshKind::nothing().with_cpu(CpuRefreshKind::nothing());
        let system = System::new_with_specifics(what.with_memory(MemoryRefreshKind::everything())).ok();
        let cpu = system.as_ref().and_then(|system| Some(system.cpus().first()?.brand().trim().to_owned()));
        let unknown = || "unknown".to_owned();
        let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
        let git = |arguments: &[&str]| output("git", &[&["-C", root], arguments].concat());
        Self {
            cpu: cpu.unwrap_or_else(unknown),
            cores: std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
            memory_bytes: system.map_or(0, |system| system.total_memory()),
            system: System::long_os_version().unwrap_or_else(|_| std::env::consts::OS.to_owned()),
            instruction_sets: instruction_sets(),
            rustc: output("rustc", &["--version"]).unwrap_or_else(unknown),
            commit: git(&["rev-parse", "HEAD"]).unwrap_or_else(unknown),
            clean_tree: git(&["status", "--porcelain"]).is_some_and(|changes| changes.is_empty()),
            date: jiff::Timestamp::now().strftime("%Y-%m-%d %H:%M UTC").to_string(),
            two_threads: vec![],
        }
    }
}

/// Bytes that are free now; none where the system does not tell.
pub(crate) fn available_memory() -> Option<u64> {
    let what = RefreshKind::nothing().with_memory(MemoryRefreshKind::everything());
    Some(System::new_with_specifics(what).ok()?.available_memory())
}

/// Bytes of the second and of the third cache; 1 and 16 MiB where the system does not tell.
pub(crate) fn caches() -> [usize; 2] {
    [(2, 1 << 10), (3, 16 << 10)].map(|(index, otherwise)| {
        let size = std::fs::read_to_string(format!("/sys/devices/system/cpu/cpu0/cache/index{index}/size")).ok();
        let kibibytes = size.and_then(|size| size.trim().strip_suffix('K')?.parse::<usize>().ok());
        kibibytes.unwrap_or(otherwise) << 10
    })
}

/// What a command prints, without the last line's end; `None` where it cannot be run or fails.
fn output(program: &str, arguments: &[&str]) -> Option<String> {
    let output = Command::new(program).args(arguments).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim_end().to_owned())
}
