//! The recorder collects commands in segments that fit a submission.

use std::ops::Range;

use indexmap::{IndexMap, IndexSet};

use crate::{BindGroup, Buffer, Command, Segment};

/// All parts of a program, in the order recorded.
pub(crate) struct Recorder {
    parts: Vec<PartRecorder>,
    /// The most message entries of a segment.
    most: u64,
}

/// One part.
pub(crate) struct PartRecorder {
    segments: Vec<Segment>,
    most: u64,
}

impl Recorder {
    pub(crate) fn new(most: u64) -> Self {
        Self { parts: Vec::new(), most }
    }

    /// Begins another part.
    pub(crate) fn part(&mut self) -> &mut PartRecorder {
        self.parts.push_mut(PartRecorder { segments: Vec::new(), most: self.most })
    }

    /// All segments, and the range of segments of each part.
    pub(crate) fn finish(
        self,
        bind_groups: &IndexSet<BindGroup>,
        buffers: &[Buffer],
    ) -> (Vec<Segment>, Vec<Range<usize>>) {
        let mut segments = Vec::new();
        let mut parts = Vec::new();
        for mut part in self.parts {
            part.count_moved_bytes(bind_groups, buffers);
            let first = segments.len();
            segments.append(&mut part.segments);
            parts.push(first..segments.len());
        }
        (segments, parts)
    }
}

impl PartRecorder {
    /// Appends a command that counts as this many message entries.
    pub(crate) fn push(&mut self, command: Command, entries: u64) {
        match self.segments.last_mut() {
            Some(last) if last.entries + entries <= self.most => {
                last.commands.push(command);
                last.entries += entries;
            }
            _ => self.segments.push(Segment { commands: vec![command], entries, moved_bytes: 0 }),
        }
    }

    /// Appends a command that takes little time. A barrier behind another has no effect.
    pub(crate) fn push_short(&mut self, command: Command) {
        let last = self.segments.last().and_then(|segment| segment.commands.last());
        if command == Command::Barrier && last == Some(&command) {
            return;
        }
        self.push(command, 0);
    }

    /// Counts the bytes moved: each bound buffer once per part, and the bytes of a copy twice.
    fn count_moved_bytes(&mut self, bind_groups: &IndexSet<BindGroup>, buffers: &[Buffer]) {
        let mut bound: IndexMap<usize, u64> = IndexMap::new();
        let mut others = 0;
        for command in self.segments.iter().flat_map(|segment| &segment.commands) {
            match command {
                Command::Dispatch { bind_group, .. } => {
                    bound
                        .extend(bind_groups[*bind_group].buffers.iter().map(|&buffer| (buffer, buffers[buffer].bytes)));
                }
                Command::Copy { bytes, .. } => others += 2 * bytes,
                Command::Clear { buffer } => others += buffers[*buffer].bytes,
                Command::Barrier => (),
            }
        }
        if let Some(first) = self.segments.first_mut() {
            first.moved_bytes = others + bound.values().sum::<u64>();
        }
    }
}
