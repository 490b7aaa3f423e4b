//! The list of all backends, and how options name their devices.

use std::time::{Duration, Instant};

use bp_core::{Backend, Device, DeviceInfo};

use crate::{Cause, Error};

/// All backends of this build; the first is the reference.
pub const ALL: &[&dyn Backend] = &[
    &bp_cpu_scalar::Scalar,
    &bp_cpu_rayon::Rayon,
    #[cfg(feature = "vulkan")]
    &bp_vulkan::Vulkan,
    #[cfg(feature = "wgpu")]
    &bp_wgpu::Wgpu,
];

/// The backends that a build may leave out. The cargo feature of each has the same name.
const OPTIONAL: [&str; 2] = ["vulkan", "wgpu"];

/// The default backend.
pub const DEFAULT: &str = "rayon";

/// An open device.
pub struct Opened {
    /// Its name in options and records; see [`device_name`].
    pub name: String,
    /// Information about the device.
    pub info: DeviceInfo,
    /// The device.
    pub device: Box<dyn Device>,
    /// How long opening took, including the test of the device.
    pub open_time: Duration,
    backend: &'static dyn Backend,
    index: usize,
    lost: bool,
}

impl Opened {
    /// Opens a device of a backend that need not be in [`ALL`], such as one made for a test.
    ///
    /// # Errors
    /// Those of [`Backend::open`], and [`bp_core::Error::Unavailable`] if the backend does not list the device.
    pub fn of(backend: &'static dyn Backend, index: usize) -> Result<Self, bp_core::Error> {
        let info = backend.devices().into_iter().nth(index);
        Chosen { name: device_name(backend, index), backend, index, info }.open()
    }

    /// Remembers whether an error means that the device is lost.
    pub fn note(&mut self, cause: Cause) {
        self.lost |= cause == Cause::DeviceLost;
    }

    /// Opens the device again if it was lost.
    ///
    /// # Errors
    /// [`Error::Unavailable`] if it is gone.
    pub fn recover(&mut self) -> Result<(), Error> {
        if !self.lost {
            return Ok(());
        }
        let failed = |reason| Error::Unavailable(format!("it was lost and cannot be opened again: {reason}"));
        // Otherwise another device could silently take its place.
        if self.backend.devices().get(self.index) != Some(&self.info) {
            return Err(failed("it is not listed any more".to_owned()));
        }
        self.device = self.backend.open(self.index).map_err(|error| failed(reason(error)))?;
        self.lost = false;
        Ok(())
    }
}

/// A backend and one of its devices, not opened yet.
pub struct Chosen {
    /// See [`Opened::name`]. If the backend has no devices, the option as given.
    pub name: String,
    backend: &'static dyn Backend,
    index: usize,
    info: Option<DeviceInfo>,
}

impl Chosen {
    /// Opens the device.
    ///
    /// # Errors
    /// Those of [`Backend::open`].
    pub fn open(self) -> Result<Opened, bp_core::Error> {
        let Self { name, backend, index, info } = self;
        let start = Instant::now();
        let device = backend.open(index)?;
        let open_time = start.elapsed();
        log::debug!("opened device {index} of backend {name} in {open_time:?}");
        let unlisted = || {
            let reason = "its driver failed to list it at first and opens it now; run the command again".to_owned();
            bp_core::Error::Unavailable { backend: backend.name(), device: index, reason }
        };
        Ok(Opened { name, info: info.ok_or_else(unlisted)?, device, open_time, backend, index, lost: false })
    }
}

/// The name of a device in options and records: its backend's, with the device's index unless that is 0.
#[must_use]
pub fn device_name(backend: &dyn Backend, index: usize) -> String {
    if index == 0 { backend.name().to_owned() } else { format!("{}:{index}", backend.name()) }
}

/// Finds the device named by a backend, by "BACKEND:DEVICE", or by a backend and a device.
///
/// # Errors
/// [`Error::Options`] if two devices are named, [`Error::Unavailable`] if the backend or device does not exist.
pub fn choose(option: &str, device: Option<&str>) -> Result<Chosen, Error> {
    let (name, after_colon) = option.split_once(':').map_or((option, None), |(name, device)| (name, Some(device)));
    if let (Some(_), Some(device)) = (after_colon, device) {
        return Err(Error::Options(format!(
            "`backend` {option} names a device, and `device` {device} names one too: give one of them"
        )));
    }
    let backend = ALL.iter().copied().find(|backend| backend.name() == name).ok_or_else(|| no_backend(name))?;
    let mut devices = backend.devices();
    let index = match device.or(after_colon) {
        // Opening then fails with the reason.
        Some(_) if devices.is_empty() => return Ok(Chosen { name: option.to_owned(), backend, index: 0, info: None }),
        Some(wanted) => match find(&devices, wanted)[..] {
            [index] => index,
            ref found => return Err(not_one(backend, &devices, wanted, found.len())),
        },
        None => 0,
    };
    let info = (index < devices.len()).then(|| devices.swap_remove(index));
    Ok(Chosen { name: device_name(backend, index), backend, index, info })
}

/// Opens the device that these options name.
///
/// # Errors
/// Those of [`choose`], and [`Error::Unavailable`] with the reason.
pub fn open(option: &str, device: Option<&str>) -> Result<Opened, Error> {
    choose(option, device)?.open().map_err(|error| Error::Unavailable(error.to_string()))
}

/// Opens the reference backend.
///
/// # Errors
/// Those of [`open`].
pub fn reference() -> Result<Opened, Error> {
    open(ALL[0].name(), None)
}

/// Why a device could not be opened, for messages that already name its backend.
#[must_use]
pub fn reason(error: bp_core::Error) -> String {
    match error {
        bp_core::Error::Unavailable { reason, .. } => reason,
        other => other.to_string(),
    }
}

/// The indices of the devices that match an index, a name or part of a name, or the beginning of a UUID.
fn find(devices: &[DeviceInfo], wanted: &str) -> Vec<usize> {
    if let Ok(index) = wanted.parse() {
        // Names and UUIDs have digits too, but a short number is an index: "1" must not match a name with "1 thread".
        if index < devices.len() || wanted.len() <= 2 {
            return Vec::from_iter((index < devices.len()).then_some(index));
        }
    }
    let wanted = wanted.to_lowercase();
    let all = |is_it: &dyn Fn(&DeviceInfo) -> bool| -> Vec<usize> {
        (0..devices.len()).filter(|&index| !wanted.is_empty() && is_it(&devices[index])).collect()
    };
    // An exact match wins, because a name may be part of another device's name.
    let named = all(&|device| device.name.to_lowercase() == wanted);
    let like = |device: &DeviceInfo| {
        let uuid = device.uuid.as_ref().is_some_and(|uuid| uuid.starts_with(&wanted));
        uuid || device.name.to_lowercase().contains(&wanted)
    };
    if named.is_empty() { all(&like) } else { named }
}

fn no_backend(name: &str) -> Error {
    let known: Vec<_> = ALL.iter().map(|backend| backend.name()).collect();
    let left_out = OPTIONAL.contains(&name);
    let advice = if left_out { format!("; build with the feature {name}") } else { String::new() };
    Error::Unavailable(format!("`backend` {name}: this build has {}{advice}", known.join(", ")))
}

/// The error when a name matches no device, or several. It lists all devices.
fn not_one(backend: &dyn Backend, devices: &[DeviceInfo], wanted: &str, found: usize) -> Error {
    let line =
        |(index, device): (usize, &DeviceInfo)| format!("\n  {:<12}{}", device_name(backend, index), device.name);
    let lines: String = devices.iter().enumerate().map(line).collect();
    let what =
        if found == 0 { format!("no device \"{wanted}\"") } else { format!("{found} devices like \"{wanted}\"") };
    Error::Unavailable(format!("backend {} has {what}; there are:{lines}", backend.name()))
}

#[cfg(test)]
mod tests {
    use bp_core::DeviceKind;

    use super::*;

    fn device(name: &str, uuid: Option<&str>) -> DeviceInfo {
        DeviceInfo {
            name: name.to_owned(),
            kind: DeviceKind::DiscreteGpu,
            api: None,
            driver: None,
            memory_bytes: None,
            uuid: uuid.map(str::to_owned),
            workers: 1,
        }
    }

    /// A backend whose driver lists no device, as if memory were short for a moment, and then opens it.
    struct Late;

    impl Backend for Late {
        fn name(&self) -> &'static str {
            "late"
        }

        fn devices(&self) -> Vec<DeviceInfo> {
            Vec::new()
        }

        fn open(&self, device: usize) -> Result<Box<dyn Device>, bp_core::Error> {
            bp_cpu_scalar::Scalar.open(device)
        }
    }

    #[test]
    fn a_device_that_was_not_listed_says_what_to_do() {
        let error = Opened::of(&Late, 0).err().unwrap().to_string();
        assert!(error.contains("late") && error.contains("run the command again"), "{error}");
    }

    #[test]
    fn devices_are_found_by_index_name_and_uuid() {
        let devices = [
            device("RTX 4090", Some("12ab34cd-0000-4000-8000-000000000000")),
            device("RTX 4090 D", Some("12ac0000-0000-4000-8000-000000000000")),
            device("llvmpipe", Some("12340000-0000-4000-8000-000000000000")),
        ];
        for (wanted, found) in [
            ("1", vec![1]),
            ("3", vec![]),
            ("40", vec![]),
            ("4090", vec![0, 1]),
            ("1234", vec![2]),
            ("LLVM", vec![2]),
            ("rtx 4090", vec![0]),
            ("4090 d", vec![1]),
            ("rtx", vec![0, 1]),
            ("12AB", vec![0]),
            ("12ac0000-0", vec![1]),
            ("12a", vec![0, 1]),
            ("", vec![]),
            ("radeon", vec![]),
        ] {
            assert_eq!(find(&devices, wanted), found, "{wanted}");
        }
    }
}
