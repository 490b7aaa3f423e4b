//! The workgroups of kernels.

use bp_core::Plan;

use crate::{Kernel, Limits, Shape, WORKGROUP, segment};

/// The quads of labels that an invocation of `update_messages_of_slice` keeps in registers: what `envelope.wgsl` assumes.
const SLICE_QUADS: usize = 4;

/// The words of nodes of a workgroup whose labels are shared out: their vectors fill a cache line of 128 bytes.
const GROUP_WORDS: u32 = 8;

/// The same for `update_messages_of_slice`. An H100 takes a tenth more time with 8 words, and a sixth more with 2.
const UPDATED_WORDS: u32 = 4;

/// The quads of labels of an invocation of `pass_rows`. Few invocations run at a time there, so they should be quick.
pub(crate) const PASSED_QUADS: usize = 2;

/// The most invocations of a workgroup of `pass_rows` and `decide_rows`: each keeps about a hundred values in registers.
const SEGMENT_INVOCATIONS: u32 = 512;

/// The most words, with a side each, that a workgroup of `pass_rows` computes at a time.
const PASSED_WORDS: u32 = 64;

/// The invocations of a workgroup that a device must allow for the shape [`Shape::Slices`]: enough for 1024 labels. All GPUs of
/// desktops allow more.
pub(crate) const FEW_INVOCATIONS: u32 = 256;

/// The shape of a workgroup.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Group {
    /// Words of nodes, or other items of work.
    pub(crate) words: u32,
    /// Slices of the labels of each.
    pub(crate) slices: u32,
    /// Whether all of its words lie in the same row.
    in_a_row: bool,
}

impl Group {
    /// The workgroups of a kernel.
    pub(crate) fn of(kernel: Kernel, plan: &Plan, limits: &Limits) -> Self {
        if kernel == Kernel::LabelSets {
            return Self { words: 1, slices: 1, in_a_row: false };
        }
        if !kernel.is_sliced() || limits.shape == Shape::Words {
            return Self { words: WORKGROUP, slices: 1, in_a_row: false };
        }
        let slices = plan.model().labels().div_ceil(4 * SLICE_QUADS) as u32;
        if kernel == Kernel::UpdateMessagesOfSlice {
            // Every slice needs an invocation for each of four sides, since the slices of a message work together.
            let words = UPDATED_WORDS.min(limits.invocations / (4 * slices)).max(1);
            return Self { words, slices, in_a_row: true };
        }
        let most = SEGMENT_INVOCATIONS.min(limits.invocations);
        if kernel == Kernel::PassRows {
            let slices = plan.model().labels().div_ceil(4 * PASSED_QUADS) as u32;
            return Self { words: (most / slices).clamp(1, PASSED_WORDS), slices, in_a_row: true };
        }
        if kernel == Kernel::DecideRows {
            let words = segment::MOST_WORDS as u32;
            return Self { words, slices: (2 * slices).min(most / words).max(1), in_a_row: true };
        }
        // Without a least value to find, single quads keep the most reads under way.
        let quads = plan.model().labels().div_ceil(4) as u32;
        let slices = if kernel == Kernel::Refine { quads } else { slices };
        Self { words: GROUP_WORDS, slices: slices.min(FEW_INVOCATIONS / GROUP_WORDS), in_a_row: false }
    }

    /// How many workgroups these rows of so many words need.
    pub(crate) fn number(self, rows: usize, row_words: usize) -> usize {
        let words = self.words as usize;
        if self.in_a_row { rows * row_words.div_ceil(words) } else { (rows * row_words).div_ceil(words) }
    }

    /// How many rows of so many words these workgroups suffice for.
    pub(crate) fn rows(self, number: usize, row_words: usize) -> usize {
        let words = self.words as usize;
        if self.in_a_row { number / row_words.div_ceil(words).max(1) } else { number * words / row_words.max(1) }
    }
}

#[cfg(test)]
mod tests {
    use bp_core::{Algorithm, Model, Profile, Schedule, Size};

    use super::*;

    #[test]
    fn slices_cover_all_labels_within_the_limits() {
        let size = Size { width: 9, height: 7 };
        let settings = Algorithm::Bp.settings(size, 1, 1, Schedule::Sync);
        for (labels, invocations) in [(1, 1024), (16, 1024), (17, 1024), (128, 1024), (1024, 1024), (1024, 256)] {
            let plan = Plan::new(size, Model::new(Profile::Census, labels).unwrap(), settings).unwrap();
            let limits = Limits { invocations, shape: Shape::Slices, ..Limits::roomy() };
            let update = Group::of(Kernel::UpdateMessagesOfSlice, &plan, &limits);
            assert!(update.slices as usize * 16 >= labels && update.words >= 1);
            assert!(4 * update.words * update.slices <= invocations, "{labels} {invocations}");
            let select = Group::of(Kernel::SelectLabels, &plan, &limits);
            assert!(select.words * select.slices <= FEW_INVOCATIONS);
        }
    }
}
