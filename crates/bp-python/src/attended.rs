//! Long work, during which Python's signals and callbacks are attended to.

use std::{
    panic::resume_unwind,
    sync::{
        Mutex, PoisonError,
        mpsc::{RecvTimeoutError, channel},
    },
    thread,
    time::Duration,
};

use bp_stereo::{Error, Event, Stop, Watch};
use pyo3::{exceptions::PyOSError, prelude::*};

use crate::errors::raised;

/// The time between two checks for Ctrl-C, and between two calls of `progress`.
const PATIENCE: Duration = Duration::from_millis(50);

/// Does `work` on a thread of its own, so that this one can call `progress(done, total)` and notice Ctrl-C. If either
/// raises an exception, the work stops at its next step. Other Python threads run meanwhile.
pub(crate) fn attended<T: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Watch<'_>) -> Result<T, Error> + Send,
) -> PyResult<T> {
    let (ending, mut end) = channel::<()>();
    // Keeps only the newest counts, so that a slow callback does not delay the answer.
    let (stop, counts) = (Stop::default(), Mutex::new(None));
    let tell = |event: Event<'_>| {
        if let Event::Progress { done, total } = event {
            *counts.lock().unwrap_or_else(PoisonError::into_inner) = Some((done, total));
        }
    };
    let look = || {
        py.check_signals()?;
        let news = counts.lock().unwrap_or_else(PoisonError::into_inner).take();
        progress.zip(news).map_or(Ok(()), |(progress, news)| progress.call1(news).map(drop))
    };
    thread::scope(|scope| {
        let watch = Watch::new(&tell, &stop);
        let worker = thread::Builder::new().name("bpstereo".to_owned()).spawn_scoped(scope, move || {
            let _ending = ending;
            work(&watch)
        });
        let worker = worker.map_err(|error| PyOSError::new_err(format!("cannot start a thread: {error}")))?;
        let mut outcome = Ok(());
        loop {
            let end = &mut end;
            let is_done = py.detach(move || end.recv_timeout(PATIENCE)) == Err(RecvTimeoutError::Disconnected);
            if outcome.is_ok() {
                outcome = look();
                if outcome.is_err() {
                    stop.stop();
                }
            }
            if is_done {
                break;
            }
        }
        let done = py.detach(|| worker.join()).unwrap_or_else(|panic| resume_unwind(panic));
        outcome.and_then(|()| done.map_err(raised))
    })
}
