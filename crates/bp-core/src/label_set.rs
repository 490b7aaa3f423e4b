//! Label sets: the few labels that nodes of the finest grids may take.

use std::array;

use crate::{MAX_LABELS, Patch, Plan};

/// Neighbouring nodes are counted apart. They mostly have the same label, so each would wait for the one before.
const LANES: usize = 8;

/// How many nodes have each label, up to 255, and room after them: CPUs take places 4096 bytes apart for the same at first.
type Counts = [u8; MAX_LABELS + 64];

/// Some of a plan's labels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LabelSet {
    words: [u64; MAX_LABELS / 64],
}

impl LabelSet {
    /// The fewest labels for which [`Algorithm::Sweep`](crate::Algorithm::Sweep) uses label sets unless told otherwise. With
    /// fewer, they save little time.
    pub const WORTHWHILE: usize = 32;

    /// How far a label may lie from a coarser label.
    const REACH: usize = 1;

    /// How many nodes of the coarser grid must have such a label, to be in a set of `grid`. The labels of fewer are mostly mistakes in
    /// hidden areas, each of which would add three labels. Four nodes of grid 2 are as small as what the coarser grids find at all, and cover
    /// more than six of grid 1. With seven there, borders of bands begin to show in rendered scenes.
    #[must_use]
    pub const fn agreeing(grid: usize) -> u8 {
        if grid == 0 { 6 } else { 4 }
    }

    /// All labels below `labels`, which is at most [`MAX_LABELS`].
    #[must_use]
    pub fn all(labels: usize) -> Self {
        let word = |i: usize| match labels.saturating_sub(64 * i) {
            0 => 0,
            more => u64::MAX >> (64 - more.min(64)),
        };
        Self { words: array::from_fn(word) }
    }

    /// The set of a patch of `grid`: the labels of `plan` that differ by at most 1 from those of at least [`LabelSet::agreeing`]
    /// nodes of [`Patch::region`], or, if there is no such label, from that of any. `coarser(y)` are the labels decided in row y of
    /// the next coarser grid, `[width]`. On a grid without label sets, all labels.
    ///
    /// # Panics
    /// If such a row is shorter than that grid.
    #[must_use]
    pub fn of<'a>(plan: &Plan, grid: usize, patch: &Patch, coarser: impl Fn(usize) -> &'a [u16]) -> Self {
        let labels = plan.model().labels();
        if !plan.has_label_sets(grid) {
            return Self::all(labels);
        }
        let size = plan.size(grid + 1);
        let region = patch.region(size);
        let mut lanes: [Counts; LANES] = [[0; _]; LANES];
        for y in region.rows {
            for neighbours in coarser(y)[region.columns.clone()].chunks(LANES) {
                for (lane, &label) in lanes.iter_mut().zip(neighbours) {
                    let count = &mut lane[usize::from(label)];
                    *count = count.saturating_add(1);
                }
            }
        }
        let reached = reached(lanes.each_ref().map(|lane| &lane[..labels]));
        let reached = &reached[..labels];
        Some(Self::at_least(reached, Self::agreeing(grid)))
            .filter(|set| set.count() > 0)
            .unwrap_or_else(|| Self::at_least(reached, 1))
    }

    /// The labels that so many nodes reach.
    fn at_least(reached: &[u8], least: u8) -> Self {
        let mut set = Self { words: [0; MAX_LABELS / 64] };
        for (word, reached) in set.words.iter_mut().zip(reached.chunks(64)) {
            *word = reached.iter().rev().fold(0, |word, &count| word << 1 | u64::from(count >= least));
        }
        set
    }

    /// Whether it holds a label.
    #[must_use]
    pub fn contains(&self, label: usize) -> bool {
        self.words.get(label / 64).is_some_and(|word| word >> (label % 64) & 1 == 1)
    }

    /// The number of its labels.
    #[must_use]
    pub fn count(&self) -> usize {
        self.words.iter().map(|word| word.count_ones() as usize).sum()
    }

    /// Its labels, from the smallest to the largest.
    pub fn labels(&self) -> impl Iterator<Item = usize> + use<> {
        let words = self.words;
        (0..).step_by(64).zip(words).flat_map(|(first, mut word)| {
            std::iter::from_fn(move || {
                let lowest = (word != 0).then(|| first + word.trailing_zeros() as usize);
                word &= word.wrapping_sub(1);
                lowest
            })
        })
    }
}

/// By label, how many nodes have a label that differs by at most [`LabelSet::REACH`], up to 255.
fn reached(lanes: [&[u8]; LANES]) -> Counts {
    let labels = lanes[0].len();
    let (mut counts, mut reached): (Counts, Counts) = ([0; _], [0; _]);
    // Whole rows of counts at once, which takes vectors.
    for lane in lanes {
        let counts = counts[LabelSet::REACH..].iter_mut().zip(lane);
        counts.for_each(|(count, &more)| *count = count.saturating_add(more));
    }
    for near in counts.windows(labels).take(2 * LabelSet::REACH + 1) {
        reached.iter_mut().zip(near).for_each(|(reached, &count)| *reached = reached.saturating_add(count));
    }
    reached
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Algorithm, Model, Profile, Schedule, Settings, Size};

    fn plan(label_sets: bool) -> Plan {
        let size = Size { width: 150, height: 70 };
        let settings = Algorithm::Sweep.settings(size, 1, 1, Schedule::Sweep);
        Plan::new(size, Model::new(Profile::Census, 70).unwrap(), Settings { label_sets, ..settings }).unwrap()
    }

    #[test]
    fn a_set_reaches_one_label_from_those_of_six_nodes_of_grid_1_or_four_of_others() {
        let (plan, patch) = (plan(true), Patch { columns: 0..64, rows: 0..32 });
        for (grid, agreeing) in [(0, 6), (1, 4)] {
            let Size { width, .. } = plan.size(grid + 1);
            let mut coarser = vec![40; plan.size(grid + 1).pixels()];
            let set = |coarser: &[u16]| LabelSet::of(&plan, grid, &patch, |y| &coarser[width * y..]);
            // One too few on either side: 0 and 1, 69 and 68.
            let few = agreeing - 1;
            coarser[..few].fill(0);
            coarser[few..2 * few].fill(69);
            (coarser[0], coarser[few]) = (1, 68);
            // One more has a label near 69, but beyond the region.
            coarser[width + 34] = 69;
            assert_eq!(set(&coarser).labels().collect::<Vec<_>>(), [39, 40, 41], "grid {grid}");
            (coarser[2 * few], coarser[2 * few + 1]) = (2, 67);
            // Only 1 is near all low labels, and 68 near all high ones.
            assert_eq!(set(&coarser).labels().collect::<Vec<_>>(), [1, 39, 40, 41, 68], "grid {grid}");
            let set = set(&coarser);
            assert_eq!((set.count(), set.contains(39), set.contains(5000)), (5, true, false));
        }
    }

    #[test]
    fn where_too_few_nodes_agree_all_count() {
        let plan = {
            let size = Size { width: 5, height: 3 };
            let settings = Algorithm::Sweep.settings(size, 1, 1, Schedule::Sweep);
            let settings = Settings { label_sets: true, grids: 3, ..settings };
            Plan::new(size, Model::new(Profile::Census, 70).unwrap(), settings).unwrap()
        };
        let patch = Patch { columns: 0..5, rows: 0..3 };
        let set = LabelSet::of(&plan, 0, &patch, |y| &[0, 0, 0, 30, 40, 69][3 * y..]);
        assert_eq!(set.labels().collect::<Vec<_>>(), [0, 1, 29, 30, 31, 39, 40, 41, 68, 69]);
    }

    #[test]
    fn other_grids_keep_all_labels() {
        let patch = Patch { columns: 0..64, rows: 0..32 };
        assert_eq!(LabelSet::of(&plan(true), 2, &patch, |_| &[5; 75]), LabelSet::all(70));
        assert_eq!(LabelSet::of(&plan(false), 0, &patch, |_| &[5; 75]), LabelSet::all(70));
        assert_eq!(LabelSet::all(70).count(), 70);
        assert_eq!([0, 1, 2].map(|grid| plan(true).has_label_sets(grid)), [true, true, false]);
        assert_eq!([223, 224].map(Plan::most_grids_with_label_sets), [2, 3]);
    }
}
