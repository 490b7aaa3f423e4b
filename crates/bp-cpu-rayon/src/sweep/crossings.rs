//! How messages go on to the labels of the patches beside.

use bp_core::{EdgeLevels, Error};

use super::{
    lists::Lists,
    routes::{self, Route, Routes},
};

/// The routes of all entries to the lists of the patches to their left and right.
#[derive(Default)]
pub(crate) struct Crossings {
    routes: [Routes; 2],
}

impl Crossings {
    pub(crate) fn fit(&mut self, entries: usize) -> Result<(), Error> {
        self.routes.iter_mut().try_for_each(|routes| routes.fit(entries))
    }

    /// The routes of the entries of a patch in the list of the patch to its left (0) or right (1).
    pub(crate) fn of(&self, lists: &Lists, patch: usize, beside: usize) -> Route<'_> {
        self.routes[beside].of(lists.range(patch))
    }

    /// The most entries that there was ever room for.
    pub(crate) fn most_entries(&self) -> usize {
        self.routes[0].most_entries()
    }

    /// Finds the routes of all entries.
    pub(crate) fn find(&mut self, lists: &Lists, edges: &EdgeLevels) {
        for patch in 0..lists.patches() {
            let beside = [patch.checked_sub(1), Some(patch + 1).filter(|&next| next < lists.patches())];
            for (routes, other) in self.routes.iter_mut().zip(beside) {
                if let Some(other) = other {
                    routes.find(lists.range(patch), lists.list(patch).labels, lists.list(other).labels, edges);
                }
            }
        }
    }

    pub(crate) fn bytes(&self) -> u64 {
        self.routes.iter().map(Routes::bytes).sum()
    }
}

/// The bytes of the [`Crossings`] of so many entries.
pub(crate) fn bytes(entries: usize) -> u64 {
    routes::bytes(entries).saturating_mul(2)
}
