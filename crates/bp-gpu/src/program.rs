//! What a device does for a plan: buffers, pipelines, and the commands of every stage, in terms that any API has.

use std::ops::Range;

use bp_core::Side;

use crate::{Kernel, Parameters, Pipeline, layout::Grid};

/// Where a buffer lies and what reaches it besides kernels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Memory {
    /// On the device, cleared once when it is made; copied from and to.
    Device,
    /// Written by the host before every solve, copied from.
    Upload,
    /// Copied to, read by the host after every solve.
    Download,
}

/// A buffer of a program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Buffer {
    /// What it holds.
    pub name: &'static str,
    /// Its size in bytes, a multiple of 256, so that buffers side by side leave no gaps.
    pub bytes: u64,
    /// Where it lies.
    pub memory: Memory,
}

/// The buffers that a kernel is given from binding 1 on, as indices into [`Program::buffers`]. None of them is both read and
/// written under two bindings.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct BindGroup {
    /// The kernel, whose [`Kernel::bindings`] say what it does with them.
    pub kernel: Kernel,
    /// The buffers.
    pub buffers: Vec<usize>,
}

/// Something that a device does. Commands between two barriers do not depend on each other.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Command {
    /// Runs a kernel.
    Dispatch {
        /// Index into [`Program::pipelines`].
        pipeline: usize,
        /// Index into [`Program::bind_groups`].
        bind_group: usize,
        /// Where in the parameters its block begins, in bytes.
        parameters: u32,
        /// Number of workgroups, all in one dimension.
        workgroups: u32,
    },
    /// Copies between two buffers. Offsets and size are multiples of 4.
    Copy {
        /// Index of the buffer that is read.
        from: usize,
        /// Offset there in bytes.
        from_offset: u64,
        /// Index of the buffer that is written.
        to: usize,
        /// Offset there in bytes.
        to_offset: u64,
        /// How many bytes.
        bytes: u64,
    },
    /// Sets a whole buffer to zeros.
    Clear {
        /// Its index.
        buffer: usize,
    },
    /// What comes after sees what came before: kernels and copies alike.
    Barrier,
}

/// Commands that are recorded together. What one segment wrote, the next one sees, as if a [`Command::Barrier`] lay between
/// them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Segment {
    /// The commands.
    pub commands: Vec<Command>,
    /// Message entries that it computes, or as many as its work is worth.
    pub(crate) entries: u64,
    /// Bytes that it has to read and write at least, but for what segments of the same part count.
    pub(crate) moved_bytes: u64,
}

/// All that a device does for a plan.
#[derive(Clone, Debug)]
pub struct Program {
    /// The buffers. The first holds the parameters, its contents are [`Program::parameters`]; the second is the one of
    /// [`Memory::Upload`], the third the one of [`Memory::Download`]; all others are [`Memory::Device`].
    pub buffers: Vec<Buffer>,
    /// The parameters of all dispatches: blocks of [`Program::PARAMETER_BYTES`], each at a multiple of 256 bytes.
    pub parameters: Vec<u8>,
    /// The pipelines.
    pub pipelines: Vec<Pipeline>,
    /// The bind groups.
    pub bind_groups: Vec<BindGroup>,
    /// The segments.
    pub segments: Vec<Segment>,
    /// Most marks of a solve.
    pub marks: usize,
    /// After how many steps on a grid they repeat.
    pub(crate) periods: u32,
    /// The segments of each [`Part`], by [`Program::segments_of`].
    pub(crate) parts: Vec<Range<usize>>,
    /// Most message entries of a submission; no segment has more, unless one row has.
    pub(crate) submission_entries: u64,
    /// Where values lie.
    pub(crate) grids: Vec<Grid>,
    /// Indices of the buffers of grid 0's last messages, `[strip][side][colour]`.
    pub(crate) last_sent: Vec<[[usize; 2]; 4]>,
}

/// A part of a program: what one call of the driver asks for, or one step of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    MatchCost,
    /// The data costs of a grid from 1 on.
    Coarsen(usize),
    /// The first messages of a grid.
    Refine(usize),
    /// One step on a grid.
    UpdateMessages(usize, u32),
    SelectLabels,
}

impl Program {
    /// Index of the buffer of parameters, a storage buffer that kernels read.
    pub const PARAMETERS: usize = 0;
    /// Index of the buffer that the host writes.
    pub const UPLOAD: usize = 1;
    /// Index of the buffer that the host reads.
    pub const DOWNLOAD: usize = 2;
    /// Bytes of one block of parameters: the size to which binding 0 is bound.
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
            Part::SelectLabels => (2 + periods) * grids,
        };
        self.parts[index].clone()
    }

    /// Indices of the buffers of what the nodes of colour 0 and 1 in a strip of grid 0 sent last.
    pub(crate) fn last_sent(&self, strip: usize, side: Side) -> [usize; 2] {
        self.last_sent[strip][side as usize]
    }
}
