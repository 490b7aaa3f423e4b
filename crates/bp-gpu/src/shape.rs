//! How kernels share out nodes and labels.

use std::env;

use bp_core::{DeviceKind, Plan};

use crate::{Kernel, Limits, WORKGROUP};

/// The variable of the environment that names a shape, to measure one beside the other.
const VARIABLE: &str = "BP_GPU_SHAPE";

/// The quads of labels that an invocation of `update_messages_of_slice` keeps in registers. Its WGSL file has the same number.
const SLICE_QUADS: usize = 4;

/// The words of nodes of a workgroup whose labels are shared out: their vectors fill a cache line of 128 bytes.
const GROUP_WORDS: u32 = 8;

/// The same for `update_messages_of_slice`. An H100 takes a tenth more time with 8 words, and a sixth more with 2.
const UPDATED_WORDS: u32 = 4;

/// The most invocations of a workgroup that every device allows.
const FEW_INVOCATIONS: u32 = 256;

/// How kernels share out nodes and labels among invocations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// An invocation has a word of four nodes, all of their labels and all sides: each operation works on sixteen bytes.
    Words,
    /// An invocation has a word and a slice of the labels, and while messages are passed one side.
    Slices,
}

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

impl Shape {
    /// The shape for a device of this kind: slices for GPUs, and words for processors. The variable `BP_GPU_SHAPE` chooses one
    /// by its name: `words` or `slices`.
    ///
    /// # Errors
    /// If the variable has another value.
    pub fn of(kind: DeviceKind) -> Result<Self, String> {
        env::var_os(VARIABLE).map_or_else(|| Ok(Self::suits(kind)), |name| Self::named(&name.to_string_lossy()))
    }

    fn suits(kind: DeviceKind) -> Self {
        match kind {
            DeviceKind::Processor | DeviceKind::SoftwareRasteriser => Self::Words,
            DeviceKind::DiscreteGpu | DeviceKind::IntegratedGpu | DeviceKind::VirtualGpu | DeviceKind::Other => {
                Self::Slices
            }
        }
    }

    fn named(name: &str) -> Result<Self, String> {
        match name {
            "words" => Ok(Self::Words),
            "slices" => Ok(Self::Slices),
            _ => Err(format!("{VARIABLE}={name} is neither words nor slices")),
        }
    }
}

impl Group {
    /// The workgroups of a kernel.
    pub(crate) fn of(kernel: Kernel, plan: &Plan, limits: &Limits) -> Self {
        if !kernel.is_sliced() || limits.shape == Shape::Words {
            return Self { words: WORKGROUP, slices: 1, in_a_row: false };
        }
        let slices = plan.model().labels().div_ceil(4 * SLICE_QUADS) as u32;
        if kernel == Kernel::UpdateMessagesOfSlice {
            // Every slice needs an invocation for each of four sides, since the slices of a message work together.
            let words = UPDATED_WORDS.min(limits.invocations / (4 * slices)).max(1);
            return Self { words, slices, in_a_row: true };
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
    fn gpus_share_out_labels_and_processors_do_not() {
        for kind in DeviceKind::ALL {
            let processor = [DeviceKind::Processor, DeviceKind::SoftwareRasteriser].contains(&kind);
            let expected = if processor { Shape::Words } else { Shape::Slices };
            assert_eq!(Shape::suits(kind), expected, "{kind:?}");
        }
    }

    #[test]
    fn a_shape_can_be_asked_for_by_its_name() {
        assert_eq!(Shape::named("words"), Ok(Shape::Words));
        assert_eq!(Shape::named("slices"), Ok(Shape::Slices));
        assert_eq!(Shape::named("two"), Err("BP_GPU_SHAPE=two is neither words nor slices".to_owned()));
    }

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
