//! The runners: devices, and the threads that they run on.

use std::collections::BTreeMap;

use bp_core::DeviceKind;

use super::guarded::{Device, Lineup};
use crate::{
    backends,
    failure::Failure,
    measure::{Asked, Runner},
};

/// This backend's one thread is compared with the reference, and all of its threads with one.
const THREADED: &str = "rayon";

/// All runners that this machine has.
pub(super) struct Runners {
    pub(super) all: Vec<Runner>,
    pub(super) lineup: Lineup,
    /// Backends without a device, and why.
    pub(super) unavailable: Vec<String>,
}

/// Opens a device under the name that baselines use.
fn open(option: &str, name: &str) -> Result<Runner, Failure> {
    let unavailable = |reason| Failure::unavailable(format!("backend {option}: {reason}"));
    Ok(Asked::open(option)?.runner.map_err(unavailable)?.named(name))
}

impl Runners {
    /// Opens the first device of every backend of this build.
    pub(super) fn open() -> Result<Self, Failure> {
        let threads = rayon::current_num_threads();
        let reference = backends::ALL[0].name();
        let one_thread = format!("{THREADED} on 1 thread");
        let mut all = vec![open(reference, reference)?, open(&format!("{THREADED}@1"), &one_thread)?];
        let all_threads = (threads > 1).then(|| format!("{THREADED} on all threads"));
        if let Some(name) = &all_threads {
            // Runs in the current thread pool, which has all threads.
            all.push(open(THREADED, name)?);
        }
        let (mut devices, mut unavailable) = (Vec::new(), Vec::new());
        let others = backends::ALL.iter().map(|backend| backend.name());
        for name in others.filter(|name| ![reference, THREADED].contains(name)) {
            match open(name, name) {
                Ok(runner) => {
                    let is_software = runner.info.kind == DeviceKind::SoftwareRasteriser;
                    devices.push(Device { runner: runner.name.clone(), is_software });
                    all.push(runner);
                }
                Err(failure) => unavailable.push(failure.to_string()),
            }
        }
        let lineup = Lineup { reference: reference.to_owned(), one_thread, all_threads, devices };
        Ok(Self { all, lineup, unavailable })
    }

    /// The runner with this name.
    pub(super) fn get(&self, name: &str) -> Option<&Runner> {
        self.all.iter().find(|runner| runner.name == name)
    }

    /// The device and driver of each runner, which its times depend on.
    pub(super) fn devices(&self) -> BTreeMap<String, String> {
        let device = |runner: &Runner| {
            let driver = runner.info.driver.as_ref();
            [Some(&runner.info.name), driver].into_iter().flatten().cloned().collect::<Vec<_>>().join(", ")
        };
        self.all.iter().map(|runner| (runner.name.clone(), device(runner))).collect()
    }
}
