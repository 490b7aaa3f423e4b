//! `bp devices`: lists the devices of all backends.

use bytesize::ByteSize;
use serde::Serialize;

use super::{indented, print, print_json};
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
    print(&reports.iter().map(text).collect::<String>())
}

/// The lines of a backend.
fn text(report: &BackendReport) -> String {
    let reason = report.unavailable.as_ref();
    let mut text = reason.map_or_else(String::new, |reason| {
        format!("{:<12}{:<21}{}\n", report.backend, "unavailable", indented(reason, INDENT))
    });
    for DeviceReport { option, device } in &report.devices {
        let kind = device.kind.as_deref().unwrap_or_default();
        text += &format!("{option:<12}{kind:<21}{}\n", device.name);
        let details = details(device);
        if !details.is_empty() {
            text += &format!("{:<INDENT$}{}\n", "", details.join(", "));
        }
        if let Some(uuid) = &device.uuid {
            text += &format!("{:<INDENT$}uuid {uuid}\n", "");
        }
    }
    text
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
