//! Devices on pools of threads.

use std::{
    sync::{Mutex, PoisonError},
    time::Duration,
};

use bp_core::{Device, DeviceInfo, DeviceKind};
use rayon::{ThreadPool, ThreadPoolBuilder};

use bp_stereo::Watch;

use crate::{
    backends::{self, Opened},
    failure::Failure,
};

/// The largest number of threads that a name can request.
const MOST_THREADS: usize = 1024;

/// A device and the threads that it runs on. A lost device is opened again.
pub struct Runner {
    /// Its name in options and records.
    pub name: String,
    /// The description of the device.
    pub info: DeviceInfo,
    /// The time to open and test the device.
    pub open_time: Duration,
    opened: Mutex<Opened>,
    /// Its own threads. Without them it runs in the pool of its caller.
    pool: Option<ThreadPool>,
}

/// A requested runner, which may be unavailable.
pub struct Asked {
    /// Its name in records.
    pub name: String,
    /// The runner, or why it could not be opened.
    pub runner: Result<Runner, String>,
}

impl Asked {
    /// Opens the runner that `NAME`, `NAME:DEVICE`, `NAME@THREADS` or `NAME:DEVICE@THREADS` selects.
    ///
    /// # Errors
    /// If no such backend or device exists, if THREADS is out of range, or if the device has no threads to choose.
    pub fn open(option: &str) -> Result<Self, Failure> {
        let (device, threads) = split(option)?;
        let pool = threads.map(pool).transpose()?;
        within(pool.as_ref(), || Ok(backends::choose(device, None).map(|chosen| (chosen.name.clone(), chosen.open()))?))
            .map(|(name, opened)| {
                let name = threads.map_or(name.clone(), |threads| format!("{name}@{threads}"));
                let runner = opened.map_err(backends::reason).map(|opened| Runner::new(name.clone(), opened, pool));
                Self { name, runner }
            })
            .and_then(|asked| asked.checked(option, threads))
    }

    /// Fails if the device does not use the number of threads that its name requests.
    fn checked(self, option: &str, threads: Option<usize>) -> Result<Self, Failure> {
        match (&self.runner, threads) {
            (Ok(runner), Some(threads)) if runner.info.workers != threads => {
                Err(Failure::usage(format!("{option}: this device has no threads to choose; backend rayon has")))
            }
            _ => Ok(self),
        }
    }

    /// Opens the requested runners. Fails if a name is wrong or repeated, or if none of the runners can be opened.
    pub fn open_all(names: &[String], watch: &Watch<'_>) -> Result<Vec<Self>, Failure> {
        let mut all: Vec<Self> = Vec::new();
        for name in names {
            let asked = Self::open(name)?;
            if all.iter().any(|other| other.name == asked.name) {
                return Err(Failure::usage(format!("--backend names {} twice", asked.name)));
            }
            all.push(asked);
        }
        all.iter().filter_map(Self::caution).for_each(|line| watch.note(&line));
        if all.iter().all(|asked| asked.runner.is_err()) {
            return Err(Failure::unavailable(format!("--backend {}: none is available", names.join(","))));
        }
        Ok(all)
    }

    /// The runners that could be opened.
    pub fn opened(all: &[Self]) -> impl Iterator<Item = &Runner> {
        all.iter().filter_map(|asked| asked.runner.as_ref().ok())
    }

    /// A warning about the device, for readers of the numbers.
    fn caution(&self) -> Option<String> {
        let name = &self.name;
        match &self.runner {
            Err(reason) => Some(format!("{name}: unavailable: {reason}")),
            Ok(runner) if runner.info.kind == DeviceKind::SoftwareRasteriser => {
                Some(format!("{name}: {} is a software rasteriser: its times are not a GPU's", runner.info.name))
            }
            Ok(_) => None,
        }
    }
}

/// Splits a name into the device and the number of threads.
fn split(option: &str) -> Result<(&str, Option<usize>), Failure> {
    let Some((device, threads)) = option.rsplit_once('@') else { return Ok((option, None)) };
    let threads = threads.parse().ok().filter(|threads| (1..=MOST_THREADS).contains(threads));
    let refused = || Failure::usage(format!("{option}: after @ comes a number of threads, 1 to {MOST_THREADS}"));
    Ok((device, Some(threads.ok_or_else(refused)?)))
}

fn pool(threads: usize) -> Result<ThreadPool, Failure> {
    let failed = |error| Failure::other(format!("cannot start the threads: {error}"));
    ThreadPoolBuilder::new().num_threads(threads).build().map_err(failed)
}

fn within<T: Send>(pool: Option<&ThreadPool>, work: impl FnOnce() -> T + Send) -> T {
    match pool {
        Some(pool) => pool.install(work),
        None => work(),
    }
}

impl Runner {
    fn new(name: String, opened: Opened, pool: Option<ThreadPool>) -> Self {
        let (info, open_time) = (opened.info.clone(), opened.open_time);
        Self { name, info, open_time, opened: Mutex::new(opened), pool }
    }

    /// The same runner under another name.
    pub fn named(self, name: &str) -> Self {
        Self { name: name.to_owned(), ..self }
    }

    /// Runs some work on the device's threads.
    pub fn run<T: Send>(&self, work: impl FnOnce() -> Result<T, Failure> + Send) -> Result<T, Failure> {
        within(self.pool.as_ref(), work).inspect_err(|failure| self.opened().note(failure.cause()))
    }

    /// Runs some work on the device, which is reopened first if it was lost.
    pub fn on_device<T: Send>(
        &self,
        work: impl FnOnce(&dyn Device) -> Result<T, Failure> + Send,
    ) -> Result<T, Failure> {
        self.run(|| {
            let mut opened = self.opened();
            opened.recover()?;
            work(opened.device.as_ref())
        })
    }

    fn opened(&self) -> std::sync::MutexGuard<'_, Opened> {
        self.opened.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether the wall clock can time its stages. A call to a CPU backend takes as long as the work. A call to a GPU
    /// backend only submits the work, so only the device's own clock can time it.
    pub fn waits(&self) -> bool {
        self.info.api.is_none()
    }
}

#[cfg(test)]
impl Runner {
    /// A runner for tests.
    pub fn of(opened: Opened) -> Self {
        Self::new(opened.name.clone(), opened, None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn open(option: &str) -> Result<Runner, Failure> {
        Asked::open(option).map(|asked| asked.runner.unwrap())
    }

    #[test]
    fn a_name_may_say_how_many_threads_a_device_has() {
        let runner = open("rayon:0@3").unwrap();
        assert_eq!((runner.name.as_str(), runner.info.workers), ("rayon@3", 3));
        assert_eq!(runner.run(|| Ok(rayon::current_num_threads())).unwrap(), 3);
        assert_eq!(open("rayon").unwrap().name, "rayon");
        for (option, word) in [("rayon@0", "1 to 1024"), ("rayon@", "1 to 1024"), ("scalar@2", "no threads")] {
            let refused = open(option).map(|runner| runner.name).unwrap_err();
            assert!(refused.kind() == crate::Kind::Usage && refused.to_string().contains(word), "{option}: {refused}");
        }
    }
}
