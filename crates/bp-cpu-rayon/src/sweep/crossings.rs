//! How messages go on to the labels of the patches beside.

use std::ops::Range;

use bp_core::{EdgeLevels, Error, memory};

use super::lists::{Lists, Source, sources};

/// For each entry, its source in the list of the patch to the left and in that to the right.
#[derive(Default)]
pub(crate) struct Crossings {
    sources: Vec<[Source; 2]>,
}

impl Crossings {
    pub(crate) fn fit(&mut self, entries: usize) -> Result<(), Error> {
        memory::grow("label sets", &mut self.sources, entries, [Source::NONE; 2])
    }

    /// The sources of some entries.
    pub(crate) fn of(&self, entries: Range<usize>) -> &[[Source; 2]] {
        &self.sources[entries]
    }

    /// The most entries that there was ever room for.
    pub(crate) fn most_entries(&self) -> usize {
        self.sources.len()
    }

    /// Finds the sources of all entries.
    pub(crate) fn find(&mut self, lists: &Lists, edges: &EdgeLevels) {
        for patch in 0..lists.patches() {
            let labels = lists.list(patch).labels;
            let beside = [patch.checked_sub(1), Some(patch + 1).filter(|&next| next < lists.patches())];
            for (index, other) in beside.into_iter().enumerate() {
                let Some(other) = other else { continue };
                let sources = sources(lists.list(other).labels, labels, edges);
                let all = self.sources[lists.range(patch)].iter_mut().zip(sources);
                all.for_each(|(sources, source)| sources[index] = source);
            }
        }
    }

    pub(crate) fn bytes(&self) -> u64 {
        memory::bytes(&self.sources)
    }
}

/// The bytes of the [`Crossings`] of so many entries.
pub(crate) fn bytes(entries: usize) -> u64 {
    (entries as u64).saturating_mul(size_of::<[Source; 2]>() as u64)
}
