//! The labels of rows that are passed together: a list for each patch.

use std::ops::Range;

use bp_core::{EdgeLevels, Error, LabelSet, Smoothness, memory};

/// What the smoothness costs over edges of each level.
pub(crate) type Steps = [u8; EdgeLevels::COUNT];

/// The lists of the patches of some rows, one after another. An *entry* is a label of a list.
#[derive(Default)]
pub(crate) struct Lists {
    /// The label of each entry. They ascend within a patch.
    labels: Vec<u16>,
    /// For each patch the steps of its entries, and one more. See [`List::steps`].
    steps: Vec<Steps>,
    /// The first entry of each patch, and the number of entries.
    starts: Vec<usize>,
}

/// The list of one patch.
#[derive(Clone, Copy)]
pub(crate) struct List<'a> {
    /// The labels.
    pub(crate) labels: &'a [u16],
    /// What the smoothness costs from the entry before to this one. The first and the last value, after the last entry, mean
    /// nothing.
    pub(crate) steps: &'a [Steps],
}

/// The bytes of lists with this many patches and entries.
pub(crate) fn bytes(patches: usize, entries: usize) -> u64 {
    (entries * (size_of::<u16>() + size_of::<Steps>())
        + patches * size_of::<Steps>()
        + (patches + 1) * size_of::<usize>()) as u64
}

impl Lists {
    /// Makes the lists of patches with these sets.
    pub(crate) fn fill(&mut self, edges: &EdgeLevels, sets: &[LabelSet]) -> Result<(), Error> {
        self.fit(sets.len(), sets.iter().map(LabelSet::count).sum())?;
        sets.iter().for_each(|&set| self.push(edges, set));
        Ok(())
    }

    fn clear(&mut self) {
        self.labels.clear();
        self.steps.clear();
        self.starts.clear();
    }

    /// Makes room for so many patches and entries.
    pub(crate) fn fit(&mut self, patches: usize, entries: usize) -> Result<(), Error> {
        self.clear();
        let needed = bytes(patches, entries);
        let reserved = self.labels.try_reserve_exact(entries).and_then(|()| {
            self.steps.try_reserve_exact(entries + patches)?;
            self.starts.try_reserve_exact(if patches > 0 { patches + 1 } else { 0 })
        });
        reserved.map_err(|_| Error::OutOfMemory { what: "label sets", needed, available: None })
    }

    fn push(&mut self, edges: &EdgeLevels, set: LabelSet) {
        if self.starts.is_empty() {
            self.starts.push(0);
        }
        let mut before = 0;
        for label in set.labels() {
            self.labels.push(label as u16);
            self.steps.push(edges.smoothness().map(|smoothness| cost_of(smoothness, label - before)));
            before = label;
        }
        self.steps.push(Steps::default());
        self.starts.push(self.labels.len());
    }

    /// The number of patches.
    pub(crate) fn patches(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// The number of entries.
    pub(crate) fn entries(&self) -> usize {
        self.labels.len()
    }

    /// The entries of a patch.
    #[inline(always)]
    pub(crate) fn range(&self, patch: usize) -> Range<usize> {
        self.starts[patch]..self.starts[patch + 1]
    }

    /// The list of a patch.
    #[inline(always)]
    pub(crate) fn list(&self, patch: usize) -> List<'_> {
        let range = self.range(patch);
        List { labels: &self.labels[range.clone()], steps: &self.steps[range.start + patch..range.end + patch + 1] }
    }

    /// The bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        memory::bytes(&self.labels) + memory::bytes(&self.steps) + memory::bytes(&self.starts)
    }
}

/// What the smoothness costs at this distance of labels, before truncation and at most 255.
fn cost_of(smoothness: Smoothness, distance: usize) -> u8 {
    (usize::from(smoothness.slope) * distance).min(usize::from(u8::MAX)) as u8
}

/// Where the value of a message for a label comes from, if it was computed for another list: the nearest entries below and
/// above, at these distances of labels. A message rises by at most s from label to label, so farther entries offer no less.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Source {
    entries: [u16; 2],
    /// What the smoothness costs from either.
    costs: [Steps; 2],
}

impl Source {
    pub(crate) const NONE: Self = Self { entries: [0; 2], costs: [[0; EdgeLevels::COUNT]; 2] };

    /// The entry, if the value is that of an entry.
    #[inline(always)]
    pub(crate) fn exact(&self) -> Option<usize> {
        let is_exact = self.entries[0] == self.entries[1] && self.costs[0] == Steps::default();
        is_exact.then_some(usize::from(self.entries[0]))
    }

    /// Both entries and what the smoothness costs from them over edges of this level.
    #[inline(always)]
    pub(crate) fn nearest(&self, level: usize) -> [(usize, u8); 2] {
        [0, 1].map(|i| (usize::from(self.entries[i]), self.costs[i][level]))
    }

    /// The value for this label.
    #[inline(always)]
    pub(crate) fn value(&self, level: usize, truncation: u8, message: impl Fn(usize) -> u8) -> u8 {
        // In 16 bits no sum saturates, and none above the truncation counts.
        let [below, above] = self.nearest(level).map(|(entry, cost)| u16::from(message(entry)) + u16::from(cost));
        below.min(above).min(truncation.into()) as u8
    }
}

/// The sources of the labels `to` in a list of the labels `from`. Both ascend.
pub(crate) fn sources(from: &[u16], to: &[u16], edges: &EdgeLevels) -> impl Iterator<Item = Source> {
    let smoothness = edges.smoothness();
    let mut above = 0;
    to.iter().map(move |&label| {
        while above + 1 < from.len() && from[above] < label {
            above += 1;
        }
        if from[above] == label {
            return Source { entries: [above as u16; 2], ..Source::NONE };
        }
        let below = if from[above] > label { above.saturating_sub(1) } else { above };
        let costs = |entry: usize| smoothness.map(|smoothness| cost_of(smoothness, from[entry].abs_diff(label).into()));
        Source { entries: [below as u16, above as u16], costs: [costs(below), costs(above)] }
    })
}

#[cfg(test)]
mod tests {
    use bp_core::{Model, Profile};

    use super::*;

    #[test]
    fn sources_are_the_nearest_entries_on_both_sides() {
        let model = Model::new(Profile::Census, 30).unwrap().with_edges_halved_above(7);
        let found: Vec<_> = sources(&[3, 5, 9], &[1, 3, 4, 9, 10, 20], model.edges()).collect();
        let costs = |distance: u8| [2 * distance, distance, distance, distance];
        let source = |entries, distances: [u8; 2]| Source { entries, costs: distances.map(costs) };
        let expected = [
            source([0, 0], [2, 2]),
            source([0, 0], [0, 0]),
            source([0, 1], [1, 1]),
            source([2, 2], [0, 0]),
            source([2, 2], [1, 1]),
            source([2, 2], [11, 11]),
        ];
        assert_eq!(found, expected);
        assert_eq!(found.iter().map(Source::exact).collect::<Vec<_>>(), [None, Some(0), None, Some(2), None, None]);
    }
}
