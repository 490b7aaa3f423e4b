//! The devices that a run asks for.

use super::{Opened, choose, reason};
use crate::{failure::Failure, note};

/// A backend that a run asks for.
pub(crate) struct Asked {
    /// Its name in records.
    pub(crate) name: String,
    /// Its device, or why there is none.
    pub(crate) device: Result<Opened, String>,
}

/// Opens the devices that a run asks for, each once. One that cannot be opened is no failure as long as another can.
pub(crate) fn open_all(names: &[String]) -> Result<Vec<Asked>, Failure> {
    let mut all: Vec<Asked> = Vec::new();
    for name in names {
        let chosen = choose(name, None)?;
        let name = chosen.name.clone();
        if all.iter().any(|other| other.name == name) {
            return Err(Failure::usage(format!("--backend names {name} twice")));
        }
        all.push(Asked { name, device: chosen.open().map_err(reason) });
    }
    all.iter().filter_map(warning).for_each(|line| note(&line));
    if all.iter().all(|asked| asked.device.is_err()) {
        return Err(Failure::unavailable(format!("--backend {}: none is available", names.join(","))));
    }
    Ok(all)
}

/// What must be known before the numbers are seen.
fn warning(Asked { name, device }: &Asked) -> Option<String> {
    match device {
        Err(reason) => Some(format!("{name}: unavailable: {reason}")),
        Ok(opened) if opened.info.kind == bp_core::DeviceKind::SoftwareRasteriser => {
            Some(format!("{name}: {} is a software rasteriser: its times are not a GPU's", opened.info.name))
        }
        Ok(_) => None,
    }
}
