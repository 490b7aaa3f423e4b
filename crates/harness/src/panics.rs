//! Panics of code that is not the program's own, caught where an answer is due all the same.

use std::{
    any::Any,
    cell::Cell,
    panic::{self, AssertUnwindSafe},
    sync::Once,
};

thread_local! {
    /// Whether what panics on this thread is caught.
    static CAUGHT: Cell<bool> = const { Cell::new(false) };
}

/// What `work` gives, or its words where it panicked: those go into the answer, not through the hook. What it leaves
/// behind is not to be used again.
pub(crate) fn caught<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    static QUIETENED: Once = Once::new();
    // One hook for all threads: others may read files meanwhile.
    QUIETENED.call_once(|| {
        let hook = panic::take_hook();
        panic::set_hook(Box::new(move |about| {
            if !CAUGHT.get() {
                hook(about);
            }
        }));
    });
    let before = CAUGHT.replace(true);
    let outcome = panic::catch_unwind(AssertUnwindSafe(work));
    CAUGHT.set(before);
    outcome.map_err(|payload| words(payload.as_ref()))
}

/// What a panic said.
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
        let inner = || caught(|| panic!("inside")).map(|()| 1);
        assert_eq!(caught(inner), Ok(Err("inside".to_owned())));
        let number = 2;
        assert_eq!(caught(|| panic!("number {number}")).map(|()| 1), Err("number 2".to_owned()));
    }
}
