//! Turns panics of third-party decoders into errors.

use std::{
    any::Any,
    cell::Cell,
    panic::{self, AssertUnwindSafe},
};

thread_local! {
    static IS_CAUGHT: Cell<bool> = const { Cell::new(false) };
}

/// Whether a panic on this thread would now become an [`crate::Error`]. A program's panic hook can check this and print
/// nothing. This library changes no hook.
#[must_use]
pub fn is_caught() -> bool {
    IS_CAUGHT.get()
}

/// Returns the result of `work`, or the message of its panic. After a panic, nothing that `work` modified may be used.
pub(crate) fn caught<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    let before = IS_CAUGHT.replace(true);
    let outcome = panic::catch_unwind(AssertUnwindSafe(work));
    IS_CAUGHT.set(before);
    outcome.map_err(|payload| words(payload.as_ref()))
}

fn words(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| payload.downcast_ref().copied()).unwrap_or("it panicked").to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_panics_become_answers() {
        assert_eq!(caught(|| 1), Ok(1));
        assert_eq!(caught(is_caught), Ok(true));
        let inner = || caught(|| panic!("inside")).map(|()| 1);
        assert_eq!(caught(inner), Ok(Err("inside".to_owned())));
        let number = 2;
        assert_eq!(caught(|| panic!("number {number}")).map(|()| 1), Err("number 2".to_owned()));
        assert!(!is_caught());
    }
}
