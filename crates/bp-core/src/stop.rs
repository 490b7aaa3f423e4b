//! How long work learns that it should end.

use crate::Error;

/// Asked now and then by work that takes long, on several threads: whether to end with [`Error::Stopped`].
pub type IsStopped<'a> = &'a (dyn Fn() -> bool + Sync);

/// An [`IsStopped`] for work that is never stopped.
#[must_use]
pub fn never() -> bool {
    false
}

pub(crate) fn go_on(is_stopped: IsStopped<'_>) -> Result<(), Error> {
    if is_stopped() { Err(Error::Stopped) } else { Ok(()) }
}
