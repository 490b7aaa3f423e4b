//! Routes: from which entries of one list the messages for the labels of another are read.
//!
//! Most labels are in both lists. Their messages are copied, for all entries alike; those for the others are then computed, and
//! replace what was copied.

use std::ops::Range;

use bp_core::{EdgeLevels, Error, memory};

use super::lists::{Source, sources};

/// For each entry, the entry of another list to read.
#[derive(Default)]
pub(crate) struct Routes {
    /// The entry with the same label, or one near it.
    nearest: Vec<u16>,
    /// The labels that the other list lacks. Those of a patch begin at its first entry, and end at its last one or at
    /// [`Between::END`].
    between: Vec<Between>,
}

/// A label that the other list lacks.
#[derive(Clone, Copy)]
struct Between {
    /// Its entry, counted from the first one of its patch.
    entry: u16,
    source: Source,
}

impl Between {
    const END: Self = Self { entry: u16::MAX, source: Source::NONE };
}

/// The bytes of [`Routes`] of so many entries.
pub(crate) fn bytes(entries: usize) -> u64 {
    (entries as u64).saturating_mul((size_of::<u16>() + size_of::<Between>()) as u64)
}

impl Routes {
    /// Makes room for so many entries.
    pub(crate) fn fit(&mut self, entries: usize) -> Result<(), Error> {
        memory::grow("label sets", &mut self.nearest, entries, 0)?;
        memory::grow("label sets", &mut self.between, entries, Between::END)
    }

    /// The most entries that there was ever room for.
    pub(crate) fn most_entries(&self) -> usize {
        self.nearest.len()
    }

    /// Finds the routes of the entries `range`, which have the labels `to`, in the list `from`.
    pub(crate) fn find(&mut self, range: Range<usize>, to: &[u16], from: &[u16], edges: &EdgeLevels) {
        let mut between = self.between[range.clone()].iter_mut();
        let nearest = self.nearest[range].iter_mut().zip(0..);
        for ((nearest, entry), source) in nearest.zip(sources(from, to, edges)) {
            *nearest = source.below();
            if source.exact().is_none()
                && let Some(between) = between.next()
            {
                *between = Between { entry, source };
            }
        }
        if let Some(end) = between.next() {
            *end = Between::END;
        }
    }

    /// The routes of some entries.
    pub(crate) fn of(&self, entries: Range<usize>) -> Route<'_> {
        Route { nearest: &self.nearest[entries.clone()], between: &self.between[entries] }
    }

    pub(crate) fn bytes(&self) -> u64 {
        memory::bytes(&self.nearest) + memory::bytes(&self.between)
    }
}

/// The routes of the entries of a patch, which are counted from its first one.
#[derive(Clone, Copy)]
pub(crate) struct Route<'a> {
    nearest: &'a [u16],
    between: &'a [Between],
}

impl Route<'_> {
    /// For each entry the one to copy.
    #[inline(always)]
    pub(crate) fn nearest(&self) -> impl Iterator<Item = usize> {
        self.nearest.iter().map(|&entry| usize::from(entry))
    }

    /// The entries that then have to be replaced, with their sources.
    #[inline(always)]
    pub(crate) fn between(&self) -> impl Iterator<Item = (usize, &Source)> {
        let all = self.between.iter().take_while(|between| between.entry != Between::END.entry);
        all.map(|between| (usize::from(between.entry), &between.source))
    }
}
