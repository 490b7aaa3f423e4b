//! Long work, during which Python's signals and callbacks are attended to.

use std::{
    sync::{Mutex, PoisonError},
    time::Duration,
};

use bp_stereo::{Ending, Error, Event, Stop, Watch};
use pyo3::prelude::*;

use crate::errors::raised;

/// The time between two checks for Ctrl-C, and between two calls of `progress`.
const PATIENCE: Duration = Duration::from_millis(50);

/// Does `work` on other threads, while this one calls `progress(done, total)` and notices Ctrl-C in what `work` gets to attend to
/// it. If either raises an exception, the work stops at its next step. Other Python threads run meanwhile.
pub(crate) fn attended<T>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Watch<'_>, &mut dyn FnMut(&mut Ending)) -> Result<T, Error>,
) -> PyResult<T> {
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
    let mut outcome = Ok(());
    let mut attend = |ending: &mut Ending| {
        loop {
            let is_done = py.detach(|| ending.wait(PATIENCE));
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
    };
    let done = work(&Watch::new(&tell, &stop), &mut attend);
    outcome.and_then(|()| done.map_err(raised))
}
