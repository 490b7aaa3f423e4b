//! The program of a plan: buffers, pipelines, and the commands of every stage, in concepts that every GPU API has.

use std::ops::Range;

use bp_core::Side;

use crate::{Kernel, Parameters, Pipeline, layout::Grid};

/// Where a buffer lies, and who accesses it besides kernels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Memory {
    /// On the device. It is cleared once, when it is created. Commands copy from it and to it.
    Device,
    /// The host writes it before every solve. Commands copy from it.
    Upload,
    /// Commands copy to it. The host reads it after every solve.
    Download,
}

/// A buffer of a program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Buffer {
    /// The name of its contents.
    pub name: &'static str,
    /// Its size in bytes, a multiple of 256, so that buffers side by side leave no gaps.
    pub bytes: u64,
    /// The kind of memory it lies in.
    pub memory: Memory,
}

/// The buffers that a kernel binds from binding 1 on, as indices into [`Program::buffers`]. No buffer is bound for both
/// reading and writing.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct BindGroup {
    /// The kernel. [`Kernel::bindings`] describes how it accesses the buffers.
    pub kernel: Kernel,
    /// The buffers.
    pub buffers: Vec<usize>,
}

/// A command. Commands between two barriers do not depend on each other.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Command {
    /// Runs a kernel.
    Dispatch {
        /// Index into [`Program::pipelines`].
        pipeline: usize,
        /// Index into [`Program::bind_groups`].
        bind_group: usize,
        /// The offset of its block of parameters, in bytes.
        parameters: u32,
        /// Number of workgroups, all in one dimension.
        workgroups: u32,
    },
    /// Copies between two buffers. Offsets and size are multiples of 4.
    Copy {
        /// Index of the source buffer.
        from: usize,
        /// Offset in the source, in bytes.
        from_offset: u64,
        /// Index of the destination buffer.
        to: usize,
        /// Offset in the destination, in bytes.
        to_offset: u64,
        /// Number of bytes.
        bytes: u64,
    },
    /// Sets a whole buffer to zeros.
    Clear {
        /// Its index.
        buffer: usize,
    },
    /// Makes everything written before the barrier, by kernels and copies, visible to commands after it.
    Barrier,
}

/// Commands that are recorded together. Each segment sees what earlier segments wrote, as if a [`Command::Barrier`]
/// stood between them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Segment {
    /// The commands.
    pub commands: Vec<Command>,
    /// The message entries that it computes, or an equivalent for other work.
    pub(crate) entries: u64,
    /// The minimum number of bytes that it reads and writes, without those counted by other segments of its part.
    pub(crate) moved_bytes: u64,
}

/// Everything that a device does for a plan.
#[derive(Clone, Debug)]
pub struct Program {
    /// The buffers. The first holds [`Program::parameters`]. The second is the only one of [`Memory::Upload`], the
    /// third the only one of [`Memory::Download`]. All others are [`Memory::Device`].
    pub buffers: Vec<Buffer>,
    /// The parameters of all dispatches: blocks of [`Program::PARAMETER_BYTES`], each at a multiple of 256 bytes.
    pub parameters: Vec<u8>,
    /// The pipelines.
    pub pipelines: Vec<Pipeline>,
    /// The bind groups.
    pub bind_groups: Vec<BindGroup>,
    /// The segments.
    pub segments: Vec<Segment>,
    /// The most marks of a solve.
    pub marks: usize,
    /// The number of steps on a grid after which their segments repeat.
    pub(crate) periods: u32,
    /// The segments of each [`Part`]; see [`Program::segments_of`].
    pub(crate) parts: Vec<Range<usize>>,
    /// The most message entries of a submission. No segment exceeds it, unless a single row does.
    pub(crate) submission_entries: u64,
    /// The layout of each grid.
    pub(crate) grids: Vec<Grid>,
    /// Indices of the buffers with the last messages of grid 0, `[strip][side][colour]`.
    pub(crate) last_sent: Vec<[[usize; 2]; 4]>,
    /// Indices of the buffers with the data costs of grid 0, `[strip][colour]`.
    pub(crate) costs: Vec<[usize; 2]>,
}

/// A part of a program: the work of one kernel call of the driver, or of one step within such a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    MatchCost,
    /// The data costs of a grid from 1 on.
    Coarsen(usize),
    /// The first messages of a grid.
    Refine(usize),
    /// One step on a grid.
    UpdateMessages(usize, u32),
    /// The labels of grid 0, or of [`bp_core::Plan::halved`].
    SelectLabels(usize),
}

impl Program {
    /// Index of the buffer of parameters, a storage buffer that kernels read.
    pub const PARAMETERS: usize = 0;
    /// Index of the buffer that the host writes.
    pub const UPLOAD: usize = 1;
    /// Index of the buffer that the host reads.
    pub const DOWNLOAD: usize = 2;
    /// Bytes of one block of parameters, which is the size of binding 0.
    pub const PARAMETER_BYTES: u64 = size_of::<Parameters>() as u64;

    /// Bytes of all buffers.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.buffers.iter().fold(0, |sum, buffer| sum.saturating_add(buffer.bytes))
    }

    /// Indices of a part's segments.
    pub(crate) fn segments_of(&self, part: Part) -> Range<usize> {
        let (grids, periods) = (self.grids.len(), self.periods as usize);
        let index = match part {
            Part::MatchCost => 0,
            Part::Coarsen(grid) => grid,
            Part::Refine(grid) => grids + grid,
            Part::UpdateMessages(grid, step) => 2 * grids + periods * grid + step as usize % periods,
            Part::SelectLabels(grid) => (2 + periods) * grids + grid,
        };
        self.parts[index].clone()
    }

    /// The indices of the buffers with the last messages to `side` from nodes of colour 0 and 1 in a strip of grid 0.
    pub(crate) fn last_sent(&self, strip: usize, side: Side) -> [usize; 2] {
        self.last_sent[strip][side as usize]
    }
}
