//! The threads that work is shared by.

use crate::failure::Failure;

/// Runs `work` on a worker of a pool of so many threads, by default as many as RAYON_NUM_THREADS
/// says, else one a processor. The rayon backend works in the pool
/// that it is called in; called from one of its workers, it need not hand every kernel over to another thread.
pub(crate) fn run_on<T: Send>(
    threads: Option<u16>,
    work: impl FnOnce() -> Result<T, Failure> + Send,
) -> Result<T, Failure> {
    let builder = rayon::ThreadPoolBuilder::new().num_threads(threads.map_or(0, usize::from));
    let failed = |error| Failure::other(format!("cannot start the threads: {error}; fewer --threads may do"));
    builder.build().map_err(failed)?.install(work)
}

/// Refuses a number of threads that none of these devices works with.
pub(crate) fn check(
    threads: Option<u16>,
    names: &[String],
    workers: impl IntoIterator<Item = usize>,
) -> Result<(), Failure> {
    match threads.map(usize::from) {
        Some(threads) if workers.into_iter().all(|workers| workers != threads) => {
            let what = format!("--backend {} has no threads; --backend rayon has", names.join(","));
            Err(Failure::usage(format!("--threads {threads}: {what}")))
        }
        _ => Ok(()),
    }
}
