//! Threads for what is not a match: making images, rectifying.

use std::{
    mem, process,
    sync::{Arc, Mutex, PoisonError},
};

use pyo3::prelude::*;
use rayon::ThreadPool;

use crate::errors::raised;

/// The threads of this process. Those of Rayon's own pool would stay with the parent after a fork, and the child would wait for
/// them for ever.
static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// Works on all threads, while other Python threads run.
pub(crate) fn together<R: Send>(py: Python<'_>, work: impl FnOnce() -> R + Send) -> PyResult<R> {
    let pool = pool().map_err(raised)?;
    Ok(py.detach(|| pool.install(work)))
}

fn pool() -> Result<Arc<ThreadPool>, bp_stereo::Error> {
    let mut pool = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, pool)) = pool.as_ref().filter(|(owner, _)| *owner == process::id()) {
        return Ok(Arc::clone(pool));
    }
    let new = Arc::new(bp_stereo::thread_pool(None)?);
    // Dropping the parent's would speak to threads that are not there.
    mem::forget(pool.replace((process::id(), Arc::clone(&new))));
    Ok(new)
}
