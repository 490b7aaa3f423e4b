//! Who runs plans: devices, and the threads that they run in.

use rayon::{ThreadPool, ThreadPoolBuilder};

use super::guarded::Lineup;
use crate::{
    backends::{self, Opened},
    failure::Failure,
};

/// The backend whose one thread is held against the reference's, and all of its threads against one.
const THREADED: &str = "rayon";

/// A problem is solved again and again until a turn has taken so many milliseconds: the times of a short solve alone
/// would mostly tell about what came before it.
const TURN_MS: f64 = 20.0;

/// The same of all threads of the fast processor backend. Systems take their time to spread threads that have just been
/// woken over the processors: until then two are no faster than one.
const TURN_OF_THREADS_MS: f64 = 300.0;

/// A device in its pool of threads.
pub(super) struct Runner {
    pub(super) name: String,
    pub(super) opened: Opened,
    /// How long its turns take at least, unless that were too many solves.
    pub(super) turn_ms: f64,
    /// Where it runs, if not in the pool of its caller.
    pool: Option<ThreadPool>,
}

/// All that this machine has.
pub(super) struct Runners {
    pub(super) all: Vec<Runner>,
    pub(super) lineup: Lineup,
    /// Backends without a device, and why.
    pub(super) unavailable: Vec<String>,
}

impl Runner {
    fn new(name: &str, backend: &str, own_threads: Option<usize>) -> Result<Self, Failure> {
        let failed = |error| Failure::other(format!("cannot start the threads: {error}"));
        let pool = own_threads.map(|threads| ThreadPoolBuilder::new().num_threads(threads).build().map_err(failed));
        let pool = pool.transpose()?;
        let opened = within(pool.as_ref(), || backends::open(backend, None))?;
        Ok(Self { name: name.to_owned(), opened, turn_ms: TURN_MS, pool })
    }

    /// Runs some work where the device's threads are.
    pub(super) fn run<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        within(self.pool.as_ref(), work)
    }

    /// What its times depend on: the device and its driver.
    pub(super) fn device(&self) -> String {
        let info = &self.opened.info;
        [Some(&info.name), info.driver.as_ref()].into_iter().flatten().cloned().collect::<Vec<_>>().join(", ")
    }
}

fn within<T: Send>(pool: Option<&ThreadPool>, work: impl FnOnce() -> T + Send) -> T {
    match pool {
        Some(pool) => pool.install(work),
        None => work(),
    }
}

impl Runners {
    /// Opens the first device of every backend of this build.
    pub(super) fn open() -> Result<Self, Failure> {
        let (mut all, mut devices, mut unavailable) = (Vec::new(), Vec::new(), Vec::new());
        let threads = rayon::current_num_threads();
        let reference = backends::ALL[0].name();
        all.push(Runner::new(reference, reference, None)?);
        let one_thread = format!("{THREADED} on 1 thread");
        all.push(Runner::new(&one_thread, THREADED, Some(1))?);
        let all_threads = (threads > 1).then(|| format!("{THREADED} on {threads} threads"));
        if let Some(name) = &all_threads {
            // In the pool that this runs in: it has them all.
            all.push(Runner { turn_ms: TURN_OF_THREADS_MS, ..Runner::new(name, THREADED, None)? });
        }
        for name in
            backends::ALL.iter().map(|backend| backend.name()).filter(|name| ![reference, THREADED].contains(name))
        {
            match Runner::new(name, name, None) {
                Ok(runner) => {
                    devices.push(runner.name.clone());
                    all.push(runner);
                }
                Err(failure) => unavailable.push(failure.to_string()),
            }
        }
        let lineup = Lineup { reference: reference.to_owned(), one_thread, all_threads, devices };
        Ok(Self { all, lineup, unavailable })
    }

    /// The runner of a name.
    pub(super) fn get(&self, name: &str) -> Option<&Runner> {
        self.all.iter().find(|runner| runner.name == name)
    }
}
