//! The threads that share the work.

use crate::failure::Failure;

/// Runs `work` on a worker of a pool with this many threads. The backend `rayon` uses the pool that it is called in. If
/// called from one of its workers, it need not hand every kernel over to another thread.
///
/// # Errors
/// Those of `work`, and a failure if the threads cannot be started.
pub fn run_on<T: Send, E: From<Failure> + Send>(
    threads: Option<u16>,
    work: impl FnOnce() -> Result<T, E> + Send,
) -> Result<T, E> {
    let pool = bp_stereo::thread_pool(threads.map(usize::from)).map_err(Failure::from)?;
    pool.install(work)
}

/// Starts the pool of all work that is done in no other one, such as reading images. Otherwise it starts when it is first needed, and
/// panics if it cannot.
///
/// # Errors
/// A failure if the threads cannot be started.
pub fn start() -> Result<(), Failure> {
    let failed = |error| Failure::other(format!("cannot start the threads: {error}; a lower RAYON_NUM_THREADS may do"));
    rayon::ThreadPoolBuilder::new().build_global().map_err(failed)
}

/// Fails if none of these devices uses the requested number of threads.
pub fn check(threads: Option<u16>, names: &[String], workers: impl IntoIterator<Item = usize>) -> Result<(), Failure> {
    match threads.map(usize::from) {
        Some(threads) if workers.into_iter().all(|workers| workers != threads) => {
            let what = format!("--backend {} has no threads; --backend rayon has", names.join(","));
            Err(Failure::usage(format!("--threads {threads}: {what}")))
        }
        _ => Ok(()),
    }
}
