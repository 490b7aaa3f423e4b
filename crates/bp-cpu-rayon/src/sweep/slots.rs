//! Values that one task makes and others read.

use std::{
    ops::Deref,
    sync::{Condvar, Mutex, MutexGuard, PoisonError, RwLock, RwLockReadGuard},
};

use bp_core::Error;

/// Memory for some of the values that tasks make one after another. Value i lies in slot i mod [`Slots::len`], where value
/// i + `len` replaces it once nobody needs it any more.
pub(super) struct Slots<T> {
    values: Vec<RwLock<T>>,
    turns: Mutex<Turns>,
    changed: Condvar,
}

/// What the slots hold.
#[derive(Default)]
struct Turns {
    slots: Vec<Turn>,
    has_failed: bool,
    /// How many threads wait for a change.
    waiting: usize,
}

#[derive(Clone, Default)]
struct Turn {
    /// The value that lies there, if one was made in this solve.
    made: Option<usize>,
    /// How many tasks have not read it yet.
    readers: usize,
}

impl<T> Slots<T> {
    /// Slots with this memory.
    pub(super) fn new(values: Vec<T>) -> Self {
        let turns = Turns { slots: vec![Turn::default(); values.len()], ..Turns::default() };
        Self {
            values: values.into_iter().map(RwLock::new).collect(),
            turns: Mutex::new(turns),
            changed: Condvar::new(),
        }
    }

    /// Forgets all values, but keeps their memory.
    pub(super) fn forget(&mut self) {
        let turns = self.turns.get_mut().unwrap_or_else(PoisonError::into_inner);
        turns.slots.fill(Turn::default());
        turns.has_failed = false;
    }

    /// Makes a value which so many tasks will read, in the memory of the one before. Waits until that was read.
    ///
    /// # Errors
    /// Those of `make`, and [`Error::Stopped`] if a task failed.
    pub(super) fn make(
        &self,
        index: usize,
        readers: usize,
        make: impl FnOnce(&mut T) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let slot = index % self.values.len();
        let before = index.checked_sub(self.values.len());
        self.wait(|turns| turns.slots[slot].made == before && turns.slots[slot].readers == 0)?;
        make(&mut self.values[slot].write().unwrap_or_else(PoisonError::into_inner))?;
        self.change(|turns| turns.slots[slot] = Turn { made: Some(index), readers });
        Ok(())
    }

    /// Waits for a value. Its slot is free for the next one when all readers have dropped it.
    ///
    /// # Errors
    /// [`Error::Stopped`] if a task failed.
    pub(super) fn read(&self, index: usize) -> Result<Reading<'_, T>, Error> {
        let slot = index % self.values.len();
        self.wait(|turns| turns.slots[slot].made == Some(index))?;
        Ok(Reading { slots: self, slot, value: self.values[slot].read().unwrap_or_else(PoisonError::into_inner) })
    }

    /// Wakes everyone who waits: a task failed.
    pub(super) fn fail(&self) {
        self.change(|turns| turns.has_failed = true);
    }

    /// Calls `of` with the memory of every slot and adds up the results.
    pub(super) fn sum(&self, of: impl Fn(&T) -> u64) -> u64 {
        self.values.iter().map(|value| of(&value.read().unwrap_or_else(PoisonError::into_inner))).sum()
    }

    fn wait(&self, until: impl Fn(&Turns) -> bool) -> Result<(), Error> {
        let waits = |turns: &mut Turns| !turns.has_failed && !until(turns);
        let mut turns = self.turns();
        turns.waiting += 1;
        let mut turns = self.changed.wait_while(turns, waits).unwrap_or_else(PoisonError::into_inner);
        turns.waiting -= 1;
        if turns.has_failed { Err(Error::Stopped) } else { Ok(()) }
    }

    /// Changes the turns and wakes those who wait, if any: telling nobody would cost a call of the system, hundreds of times a match.
    fn change(&self, change: impl FnOnce(&mut Turns)) {
        let mut turns = self.turns();
        change(&mut turns);
        if turns.waiting > 0 {
            self.changed.notify_all();
        }
    }

    fn turns(&self) -> MutexGuard<'_, Turns> {
        self.turns.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A value that a task reads.
pub(super) struct Reading<'a, T> {
    slots: &'a Slots<T>,
    slot: usize,
    value: RwLockReadGuard<'a, T>,
}

impl<T> Deref for Reading<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.value
    }
}

impl<T> Drop for Reading<'_, T> {
    fn drop(&mut self) {
        self.slots.change(|turns| {
            let turn = &mut turns.slots[self.slot];
            turn.readers = turn.readers.saturating_sub(1);
        });
    }
}

#[cfg(test)]
mod tests {
    use std::{thread, time::Duration};

    use super::*;

    #[test]
    fn a_value_replaces_another_when_all_have_read_it() {
        let mut slots = Slots::new(vec![vec![0], vec![]]);
        let is_waiting = |thread: &thread::ScopedJoinHandle<'_, _>| {
            thread::sleep(Duration::from_millis(20));
            !thread.is_finished()
        };
        let push = |value| {
            move |values: &mut Vec<i32>| {
                values.push(value);
                Ok(())
            }
        };
        thread::scope(|scope| {
            let first = scope.spawn(|| slots.read(0).map(|value| value.clone()));
            let next = scope.spawn(|| slots.make(2, 0, push(3)));
            assert!(is_waiting(&next), "value 0 is not made yet");
            slots.make(0, 2, push(1)).unwrap();
            assert_eq!(first.join().unwrap(), Ok(vec![0, 1]));
            let last = slots.read(0).unwrap();
            assert!(is_waiting(&next), "not all have read value 0");
            assert_eq!(*last, [0, 1]);
            drop(last);
            next.join().unwrap().unwrap();
            slots.make(1, 0, push(2)).unwrap();
        });
        assert_eq!([slots.read(2).unwrap().len(), slots.read(1).unwrap().len()], [3, 1]);
        assert_eq!(slots.sum(|values| values.len() as u64), 4);
        slots.forget();
        slots.make(0, 0, push(4)).unwrap();
        assert_eq!(*slots.read(0).unwrap(), [0, 1, 3, 4]);
    }

    #[test]
    fn nobody_waits_for_a_task_that_failed() {
        let slots = Slots::new(vec![1]);
        thread::scope(|scope| {
            let reader = scope.spawn(|| slots.read(0).map(|value| *value));
            assert_eq!(slots.make(0, 1, |_| Err(Error::Plan("no"))), Err(Error::Plan("no")));
            slots.fail();
            assert_eq!(reader.join().unwrap(), Err(Error::Stopped));
        });
        assert_eq!(slots.make(0, 1, |_| Ok(())), Err(Error::Stopped));
    }
}
