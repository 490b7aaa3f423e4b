//! The one list of backends.

use bp_core::{Backend, Device, DeviceInfo};

use crate::failure::Failure;

/// All backends of this build; the first is the reference.
const ALL: [&dyn Backend; 2] = [&bp_cpu_scalar::Scalar, &bp_cpu_rayon::Rayon];

/// The backend of commands that name none.
pub(crate) const DEFAULT: &str = "rayon";

/// An open device.
pub(crate) struct Opened {
    /// Its name in options and records: the backend's, with the device's index unless that is 0.
    pub(crate) name: String,
    pub(crate) info: DeviceInfo,
    pub(crate) device: Box<dyn Device>,
}

/// Opens the device that `name` or `name:index` means.
pub(crate) fn open(name: &str) -> Result<Opened, Failure> {
    let failed = |reason: String| Failure::unavailable(format!("--backend {name}: {reason}"));
    let (backend, index) = match name.split_once(':') {
        Some((backend, index)) => (backend, index.parse().map_err(|_| failed("the index is no number".to_owned()))?),
        None => (name, 0),
    };
    let known = || ALL.map(Backend::name).join(", ");
    let backend = ALL.into_iter().find(|known| known.name() == backend);
    let backend = backend.ok_or_else(|| failed(format!("this build has {}", known())))?;
    let device = backend.open(index)?;
    let info = backend.devices().into_iter().nth(index).ok_or_else(|| failed("no such device".to_owned()))?;
    let name = if index == 0 { backend.name().to_owned() } else { format!("{}:{index}", backend.name()) };
    Ok(Opened { name, info, device })
}

/// The reference backend.
pub(crate) fn reference() -> Result<Opened, Failure> {
    open(ALL[0].name())
}
