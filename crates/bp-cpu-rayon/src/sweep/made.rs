//! Values that one task makes and later ones wait for.

use std::{
    mem,
    sync::{Mutex, MutexGuard, OnceLock, PoisonError},
};

use bp_core::Error;

/// A value that one task of a solve makes, and others read. The next solve makes it again, in the same memory.
pub(super) struct Made<T> {
    /// The value of the solve before, until the task begins.
    memory: Mutex<T>,
    /// The value, or nothing if its task failed.
    value: OnceLock<Option<T>>,
}

impl<T: Default> Made<T> {
    /// Keeps this memory for the value.
    pub(super) fn new(memory: T) -> Self {
        Self { memory: Mutex::new(memory), value: OnceLock::new() }
    }

    /// Forgets the value, but keeps its memory.
    pub(super) fn forget(&mut self) {
        if let Some(value) = self.value.take().flatten() {
            *self.memory.get_mut().unwrap_or_else(PoisonError::into_inner) = value;
        }
    }

    /// Makes the value, in the memory of the one before. Those who wait are woken in any case, also after a panic.
    pub(super) fn make(&self, make: impl FnOnce(&mut T) -> Result<(), Error>) -> Result<(), Error> {
        let mut making = Making { made: self, value: mem::take(&mut *self.memory()), result: Err(Error::Stopped) };
        making.result = make(&mut making.value);
        making.result.clone()
    }

    /// The value, once it is made.
    ///
    /// # Errors
    /// [`Error::Stopped`] if its task failed.
    pub(super) fn wait(&self) -> Result<&T, Error> {
        self.value.wait().as_ref().ok_or(Error::Stopped)
    }

    /// The value, if it was made.
    pub(super) fn get(&self) -> Option<&T> {
        self.value.get()?.as_ref()
    }

    /// Calls `read` with the value or, if there is none, with the memory kept for it.
    pub(super) fn with<R>(&self, read: impl FnOnce(&T) -> R) -> R {
        match self.get() {
            Some(value) => read(value),
            None => read(&self.memory()),
        }
    }

    fn memory(&self) -> MutexGuard<'_, T> {
        self.memory.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A value while it is made.
struct Making<'a, T: Default> {
    made: &'a Made<T>,
    value: T,
    result: Result<(), Error>,
}

impl<T: Default> Drop for Making<'_, T> {
    fn drop(&mut self) {
        let value = mem::take(&mut self.value);
        let made = if self.result.is_ok() {
            Some(value)
        } else {
            *self.made.memory() = value;
            None
        };
        // Nobody else makes it.
        let _ = self.made.value.set(made);
    }
}

#[cfg(test)]
mod tests {
    use std::{panic, thread};

    use super::*;

    #[test]
    fn readers_wait_for_the_value_and_the_next_one_has_its_memory() {
        let mut made = Made::new(vec![1, 2]);
        thread::scope(|scope| {
            let reader = scope.spawn(|| made.wait().cloned());
            let push = |value: &mut Vec<i32>| {
                value.push(3);
                Ok(())
            };
            made.make(push).unwrap();
            assert_eq!(reader.join().unwrap(), Ok(vec![1, 2, 3]));
        });
        made.forget();
        assert_eq!(made.with(Vec::len), 3);
        made.make(|_| Ok(())).unwrap();
        assert_eq!(made.get(), Some(&vec![1, 2, 3]));
    }

    #[test]
    fn nobody_waits_for_a_task_that_failed() {
        let made = Made::new(vec![1]);
        assert_eq!(made.make(|_| Err(Error::Plan("no"))), Err(Error::Plan("no")));
        assert_eq!((made.wait(), made.with(Vec::clone)), (Err(Error::Stopped), vec![1]));
        let panicked = Made::new(0);
        let caught = panic::catch_unwind(panic::AssertUnwindSafe(|| panicked.make(|_| panic!("on purpose"))));
        assert!(caught.is_err());
        assert_eq!(panicked.wait(), Err(Error::Stopped));
    }
}
