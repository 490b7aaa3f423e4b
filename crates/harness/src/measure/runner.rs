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

/// The most threads that a name may ask for.
const MOST_THREADS: usize = 1024;

/// A device on the threads that it works with. It is opened again after it was lost.
pub struct Runner {
    /// Its name in options and records.
    pub name: String,
    /// What is known of the device.
    pub info: DeviceInfo,
    /// How long opening took, the test of the device included.
    pub open_time: Duration,
    opened: Mutex<Opened>,
    /// Its own threads; without them it works in the pool of its caller.
    pool: Option<ThreadPool>,
}

/// A runner that somebody asked for.
pub struct Asked {
    /// Its name in records.
    pub name: String,
    /// The runner, or why there is none.
    pub runner: Result<Runner, String>,
}

impl Asked {
    /// The runner that `NAME`, `NAME:DEVICE`, `NAME@THREADS` or `NAME:DEVICE@THREADS` means.
    ///
    /// # Errors
    /// If there is no such backend or device, or if the device has no threads to choose.
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

    /// Fails if the device does not work with the threads that its name asks for.
    fn checked(self, option: &str, threads: Option<usize>) -> Result<Self, Failure> {
        match (&self.runner, threads) {
            (Ok(runner), Some(threads)) if runner.info.workers != threads => {
                Err(Failure::usage(format!("{option}: this device has no threads to choose; backend rayon has")))
            }
            _ => Ok(self),
        }
    }

    /// Opens the runners that a run asks for, each once. It fails only if none of them can be opened.
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

    /// What a reader must know before the numbers.
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

/// The device and the number of threads in a name.
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

    /// Runs some work on the device, which is opened again if it was lost.
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

    /// Whether the stages of its samples are times. Calls of a CPU backend take as long as the work. Calls of a GPU
    /// backend only hand the work over, so that only the device's own clock knows.
    pub fn waits(&self) -> bool {
        self.info.api.is_none()
    }
}

#[cfg(test)]
impl Runner {
    /// The device of a test.
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
