//! `bp doctor`: checks this machine and reports what is missing.

use bp_core::{Backend, DeviceInfo, DeviceKind};
use bp_stereo::Memory;
use bytesize::ByteSize;
use serde::Serialize;

use super::{indented, print, print_json};
use bp_stereo::devices::{self as listed, device_name};
use harness::{machine, scenes::Source};

use crate::{
    args::{DataArgs, DoctorArgs},
    failure::Failure,
};

/// The result of one check.
#[derive(Serialize)]
struct Check {
    what: String,
    state: State,
    found: String,
    /// How to fix it.
    advice: Option<String>,
}

#[derive(Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
enum State {
    Ok,
    /// Something is missing that the default backend does not need.
    Note,
    Failed,
}

impl Check {
    fn ok(what: impl Into<String>, found: impl Into<String>) -> Self {
        Self { what: what.into(), state: State::Ok, found: found.into(), advice: None }
    }

    fn note(what: impl Into<String>, found: impl Into<String>, advice: impl Into<String>) -> Self {
        Self { state: State::Note, advice: Some(advice.into()), ..Self::ok(what, found) }
    }
}

/// Runs the command.
pub(crate) fn doctor(args: &DoctorArgs) -> Result<(), Failure> {
    let checks = checks(args);
    if args.json {
        print_json(&checks)?;
    } else {
        print(&text(&checks))?;
    }
    match checks.iter().find(|check| check.state == State::Failed) {
        None => Ok(()),
        Some(check) => Err(Failure::unavailable(format!("{} does not work: {}", check.what, check.found))),
    }
}

fn text(checks: &[Check]) -> String {
    let mut text = String::new();
    for Check { what, state, found, advice } in checks {
        let state = match state {
            State::Ok => "ok",
            State::Note => "note",
            State::Failed => "FAILED",
        };
        text += &format!("{state:<8}{what:<12}{}\n", indented(found, 20));
        if let Some(advice) = advice {
            text += &format!("{:<20}{}\n", "", indented(advice, 20));
        }
    }
    text
}

fn checks(args: &DoctorArgs) -> Vec<Check> {
    let mut checks = vec![program(), processor(), memory()];
    let mut kinds = Vec::new();
    for &backend in listed::ALL {
        checks.extend(devices(backend, &mut kinds));
    }
    checks.push(gpu(&kinds));
    #[cfg(any(feature = "vulkan", feature = "wgpu"))]
    checks.push(cache());
    checks.push(data(args));
    checks
}

fn program() -> Check {
    let names: Vec<_> = listed::ALL.iter().map(|backend| backend.name()).collect();
    let commit = machine::commit();
    let commit = commit.get(..8).unwrap_or("unknown");
    let version = env!("CARGO_PKG_VERSION");
    Check::ok("program", format!("bp {version}, commit {commit}, backends {}", names.join(", ")))
}

fn processor() -> Check {
    let machine = machine::machine(None);
    Check::ok("processor", format!("{}, {}, {}", machine.cpu, cores(machine.cores), machine.system))
}

fn cores(count: usize) -> String {
    if count == 1 { "1 core".to_owned() } else { format!("{count} cores") }
}

fn memory() -> Check {
    let iec = |bytes| ByteSize(bytes).display().iec();
    match Memory::of_machine() {
        None => Check::note("memory", "not reported by the system", "--max-memory keeps `bp match` within a limit"),
        Some(memory) => Check::ok("memory", format!("{} available of {}", iec(memory.available), iec(memory.total))),
    }
}

/// Opens every device of a backend, which tests it. Adds the kinds of the devices that work to `kinds`.
fn devices(backend: &dyn Backend, kinds: &mut Vec<DeviceKind>) -> Vec<Check> {
    let devices = backend.devices();
    let mut checks = Vec::new();
    for index in 0..devices.len().max(1) {
        let name = device_name(backend, index);
        checks.push(match (backend.open(index), devices.get(index)) {
            (Ok(_), info) => {
                kinds.extend(info.map(|info| info.kind));
                Check::ok(name, info.map_or_else(String::new, described))
            }
            (Err(error), _) if backend.name() == listed::DEFAULT && index == 0 => {
                Check { state: State::Failed, ..Check::ok(name, listed::reason(error)) }
            }
            (Err(error), _) => Check { state: State::Note, ..Check::ok(name, listed::reason(error)) },
        });
    }
    checks
}

fn described(info: &DeviceInfo) -> String {
    let software = if info.kind == DeviceKind::SoftwareRasteriser { ", a software rasteriser" } else { "" };
    format!("{}{software}", info.name)
}

/// Whether one of the devices that work is a GPU.
fn gpu(kinds: &[DeviceKind]) -> Check {
    let advice = "everything runs, but GPU times need a GPU and its vendor's Vulkan driver";
    let software = kinds.contains(&DeviceKind::SoftwareRasteriser);
    if kinds.iter().any(|kind| !matches!(kind, DeviceKind::Processor | DeviceKind::SoftwareRasteriser)) {
        Check::ok("GPU", "found and working")
    } else if software {
        Check::note("GPU", "none, only a software rasteriser, whose times say nothing about GPUs", advice)
    } else if !cfg!(any(feature = "vulkan", feature = "wgpu")) {
        Check::note("GPU", "this build has no GPU backend", "build with --features vulkan,wgpu")
    } else {
        Check::note("GPU", "none", advice)
    }
}

/// Whether compiled kernels can be cached.
#[cfg(any(feature = "vulkan", feature = "wgpu"))]
fn cache() -> Check {
    let advice = "without it, kernels may be compiled at every start; set XDG_CACHE_HOME to a writable folder";
    let Some(folder) = bp_gpu::cache::folder() else {
        return Check::note("cache", "no folder for compiled kernels: no home folder was found", advice);
    };
    let written = std::fs::create_dir_all(&folder).and_then(|()| tempfile::tempfile_in(&folder));
    let folder = folder.display();
    match written {
        Ok(_) => Check::ok("cache", format!("{folder} is writable")),
        Err(error) => Check::note("cache", format!("{folder} is not writable: {error}"), advice),
    }
}

/// Whether the public images were downloaded.
fn data(args: &DoctorArgs) -> Check {
    let advice = "the synthetic scenes are used instead; scripts/fetch-middlebury downloads the real images";
    let source = Source::new(DataArgs { data: args.data.clone(), synthetic: false }.folder(), false);
    match source.map(|source| (source.folder().map(|folder| folder.display().to_string()), source.set.described)) {
        Ok((Some(folder), described)) => Check::ok("data", format!("{folder}: {described}")),
        Ok((None, _)) => Check::note("data", "neither --data nor BP_DATA names a folder", advice),
        Err(failure) => Check::note("data", failure.to_string(), advice),
    }
}
