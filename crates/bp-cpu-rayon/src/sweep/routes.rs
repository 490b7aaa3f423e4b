//! Routes: from which entries of one list the messages for the labels of another are read.
//!
//! Most labels are in both lists, and most of these follow each other in both. Their messages are copied; those for the others
//! are computed.

use std::ops::Range;

use bp_core::{EdgeLevels, Error, memory};

use super::{
    lists::{Source, sources},
    padded::Padded,
};

/// For each entry, where to read in another list.
#[derive(Default)]
pub(crate) struct Routes {
    /// The labels that both lists have. Those of a patch begin at its first entry, and end at its last one or at [`Run::END`].
    runs: Vec<Run>,
    /// The labels that the other list lacks, in the same way.
    between: Vec<Between>,
}

/// Labels that follow each other in both lists.
#[derive(Clone, Copy)]
struct Run {
    /// The first entry, counted from the first one of its patch, and that of the other list.
    entry: u16,
    other: u16,
    len: u16,
}

impl Run {
    const END: Self = Self { entry: 0, other: 0, len: 0 };

    /// Goes on with another label, if it follows.
    fn takes(&mut self, entry: u16, other: u16) -> bool {
        let follows = self.len > 0 && (self.entry + self.len, self.other + self.len) == (entry, other);
        self.len += u16::from(follows);
        follows
    }
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
    (entries as u64).saturating_mul((size_of::<Run>() + size_of::<Between>()) as u64)
}

impl Routes {
    /// Makes room for so many entries.
    pub(crate) fn fit(&mut self, entries: usize) -> Result<(), Error> {
        memory::grow("label sets", &mut self.runs, entries, Run::END)?;
        memory::grow("label sets", &mut self.between, entries, Between::END)
    }

    /// The most entries that there was ever room for.
    pub(crate) fn most_entries(&self) -> usize {
        self.runs.len()
    }

    /// Finds the routes of the entries `range`, which have the labels `to`, in the list `from`.
    pub(crate) fn find(&mut self, range: Range<usize>, to: &[u16], from: &[u16], edges: &EdgeLevels) {
        let (runs, between) = (&mut self.runs[range.clone()], &mut self.between[range]);
        let (mut run_count, mut between_count) = (0, 0);
        for (entry, source) in (0..).zip(sources(from, to, edges)) {
            let Some(other) = source.exact() else {
                between[between_count] = Between { entry, source };
                between_count += 1;
                continue;
            };
            if run_count == 0 || !runs[run_count - 1].takes(entry, other as u16) {
                runs[run_count] = Run { entry, other: other as u16, len: 1 };
                run_count += 1;
            }
        }
        if let Some(end) = runs.get_mut(run_count) {
            *end = Run::END;
        }
        if let Some(end) = between.get_mut(between_count) {
            *end = Between::END;
        }
    }

    /// The routes of some entries.
    pub(crate) fn of(&self, entries: Range<usize>) -> Route<'_> {
        Route { runs: &self.runs[entries.clone()], between: &self.between[entries] }
    }

    pub(crate) fn bytes(&self) -> u64 {
        memory::bytes(&self.runs) + memory::bytes(&self.between)
    }
}

/// The routes of the entries of a patch, which are counted from its first one.
#[derive(Clone, Copy)]
pub(crate) struct Route<'a> {
    runs: &'a [Run],
    between: &'a [Between],
}

impl Route<'_> {
    /// The entries to copy to, and those of the other list to copy from.
    #[inline(always)]
    pub(crate) fn runs(&self) -> impl Iterator<Item = (Range<usize>, Range<usize>)> {
        let range = |first: u16, len: u16| first.into()..usize::from(first) + usize::from(len);
        let runs = self.runs.iter().take_while(|run| run.len > 0);
        runs.map(move |run| (range(run.entry, run.len), range(run.other, run.len)))
    }

    /// The other entries, with their sources.
    #[inline(always)]
    pub(crate) fn between(&self) -> impl Iterator<Item = (usize, &Source)> {
        let all = self.between.iter().take_while(|between| between.entry != Between::END.entry);
        all.map(|between| (usize::from(between.entry), &between.source))
    }

    /// Writes the messages of one node, `[other entry]`, to a lane. `message` reads one of them.
    #[inline(always)]
    pub(crate) fn carry<M>(
        &self,
        level: usize,
        truncation: u8,
        from: &[M],
        message: impl Fn(&M) -> u8,
        to: &mut [Padded],
        lane: isize,
    ) {
        for (to_run, from_run) in self.runs() {
            for (out, from) in to[to_run].iter_mut().zip(&from[from_run]) {
                *out.lane_mut(lane) = message(from);
            }
        }
        for (entry, source) in self.between() {
            *to[entry].lane_mut(lane) = source.value(level, truncation, |entry| message(&from[entry]));
        }
    }
}
