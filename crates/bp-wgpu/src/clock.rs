//! The device's own clock.

use std::time::Duration;

use bp_core::Error;
use wgpu::{
    Buffer, BufferUsages, CommandEncoder, Features, QUERY_SET_MAX_QUERIES, QUERY_SIZE, QuerySet, QuerySetDescriptor,
    QueryType, SubmissionIndex,
};

use crate::{buffers, gpu::Gpu};

/// Records the device's time at marks.
pub(crate) struct Clock {
    queries: QuerySet,
    /// The buffer that queries are resolved to. wgpu does not allow mapping it.
    resolved: Buffer,
    readable: Buffer,
    /// The nanoseconds of a tick.
    period: f64,
    marks: u32,
    times: Vec<Duration>,
}

impl Clock {
    /// The device features that it needs.
    pub(crate) const FEATURES: Features = Features::TIMESTAMP_QUERY.union(Features::TIMESTAMP_QUERY_INSIDE_ENCODERS);

    /// Makes a clock for this many marks, if the device has one.
    pub(crate) fn new(gpu: &Gpu, marks: usize) -> Result<Option<Self>, Error> {
        let count = marks.min(QUERY_SET_MAX_QUERIES as usize) as u32;
        if count == 0 || !gpu.device.features().contains(Self::FEATURES) {
            return Ok(None);
        }
        let bytes = u64::from(count * QUERY_SIZE);
        gpu.guard(2 * bytes, || {
            let (label, ty) = (Some("marks"), QueryType::Timestamp);
            Ok(Some(Self {
                queries: gpu.device.create_query_set(&QuerySetDescriptor { label, ty, count }),
                resolved: buffers::buffer(gpu, "marks", bytes, BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC),
                readable: buffers::buffer(gpu, "marks", bytes, BufferUsages::MAP_READ | BufferUsages::COPY_DST),
                period: f64::from(gpu.queue.get_timestamp_period()),
                marks: 0,
                times: Vec::with_capacity(marks),
            }))
        })
    }

    /// Discards all marks.
    pub(crate) fn reset(&mut self) {
        self.marks = 0;
        self.times.clear();
    }

    /// Adds a mark, if there is room for it.
    pub(crate) fn mark(&mut self, encoder: &mut CommandEncoder) {
        if self.marks < self.queries.count() {
            encoder.write_timestamp(&self.queries, self.marks);
            self.marks += 1;
        }
    }

    /// Copies the marks to a buffer that the host can read.
    pub(crate) fn resolve(&self, encoder: &mut CommandEncoder) {
        if self.marks > 0 {
            encoder.resolve_query_set(&self.queries, 0..self.marks, &self.resolved, 0);
            encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.readable, 0, u64::from(self.marks * QUERY_SIZE));
        }
    }

    /// Reads the marks once `last`, the submission in which they were resolved, is done.
    pub(crate) fn read(&mut self, gpu: &Gpu, last: &SubmissionIndex) -> Result<(), Error> {
        let (marks, period, times) = (self.marks as usize, self.period, &mut self.times);
        buffers::read(gpu, &self.readable, last, |bytes| {
            let (ticks, _) = bytes.as_chunks();
            times.clear();
            times.extend(between(ticks[..marks].iter().map(|tick| u64::from_le_bytes(*tick)), period));
        })
    }

    /// The times between marks.
    pub(crate) fn times(&self) -> &[Duration] {
        &self.times
    }

    /// Bytes allocated.
    pub(crate) fn bytes(&self) -> u64 {
        self.resolved.size() + self.readable.size()
    }
}

/// The times between readings of a clock with a tick of `period` nanoseconds. Empty if the clock wrapped around,
/// because wgpu does not report at which value it does.
fn between(ticks: impl Iterator<Item = u64> + Clone, period: f64) -> impl Iterator<Item = Duration> {
    let kept = if ticks.clone().is_sorted() { usize::MAX } else { 0 };
    let pairs = ticks.clone().zip(ticks.skip(1)).take(kept);
    pairs.map(move |(before, after)| Duration::from_nanos(((after - before) as f64 * period) as u64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_that_ran_over_tells_no_times() {
        let times = |ticks: &[u64]| between(ticks.iter().copied(), 2.5).collect::<Vec<_>>();
        assert_eq!(times(&[4, 8, 8]), [Duration::from_nanos(10), Duration::ZERO]);
        assert_eq!(times(&[4, 8, 1, 5]), []);
        assert_eq!(times(&[4]), []);
    }
}
