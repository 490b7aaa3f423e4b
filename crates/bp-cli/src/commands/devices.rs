//! `bp devices`: lists the devices of all backends.

use std::io::Write;

use bytesize::ByteSize;
use serde::Serialize;

use super::{indented, print_json};
use bp_stereo::{description, devices as listed, devices::device_name};

use crate::{args::DevicesArgs, failure::Failure};

/// A backend in the output of `--json`.
#[derive(Serialize)]
struct BackendReport {
    backend: &'static str,
    /// Whether it is the default backend.
    default: bool,
    devices: Vec<DeviceReport>,
    /// The reason if there are no devices.
    unavailable: Option<String>,
}

#[derive(Serialize)]
struct DeviceReport {
    /// The value for `--backend`.
    option: String,
    #[serde(flatten)]
    device: description::Device,
}

/// The column at which the names of devices begin.
const INDENT: usize = 33;

/// Runs the command.
pub(crate) fn devices(args: &DevicesArgs) -> Result<(), Failure> {
    let reports: Vec<_> = listed::ALL.iter().map(|&backend| report(backend)).collect();
    if args.json {
        return print_json(&reports);
    }
    let mut out = std::io::stdout().lock();
    for report in &reports {
        if let Some(reason) = &report.unavailable {
            writeln!(out, "{:<12}{:<21}{}", report.backend, "unavailable", indented(reason, INDENT))?;
        }
        for DeviceReport { option, device } in &report.devices {
            let kind = device.kind.as_deref().unwrap_or_default();
            writeln!(out, "{option:<12}{kind:<21}{}", device.name)?;
            let details = details(device);
            if !details.is_empty() {
                writeln!(out, "{:<INDENT$}{}", "", details.join(", "))?;
            }
            if let Some(uuid) = &device.uuid {
                writeln!(out, "{:<INDENT$}uuid {uuid}", "")?;
            }
        }
    }
    Ok(())
}

fn report(backend: &dyn bp_core::Backend) -> BackendReport {
    let devices = backend
        .devices()
        .into_iter()
        .enumerate()
        .map(|(index, info)| DeviceReport { option: device_name(backend, index), device: (&info).into() });
    let devices: Vec<_> = devices.collect();
    let unavailable = if devices.is_empty() { backend.open(0).err().map(listed::reason) } else { None };
    BackendReport { backend: backend.name(), default: backend.name() == listed::DEFAULT, devices, unavailable }
}

/// Memory, API and driver, if known.
fn details(device: &description::Device) -> Vec<String> {
    let memory = device.memory_bytes.map(|bytes| ByteSize(bytes).display().iec().to_string());
    [memory, device.api.clone(), device.driver.clone()].into_iter().flatten().collect()
}
