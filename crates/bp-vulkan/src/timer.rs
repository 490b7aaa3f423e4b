//! The device's own clock.
#![expect(unsafe_code, reason = "Vulkan is a C interface")]

use std::{sync::Arc, time::Duration};

use ash::vk;
use bp_core::Error;

use crate::{commands::Commands, gpu::Gpu, object::Owned};

/// Writes timestamps at marks.
pub(crate) struct Timer {
    queries: Owned<vk::QueryPool>,
    gpu: Arc<Gpu>,
    /// The command buffer that writes each mark's timestamp.
    marks: Vec<vk::CommandBuffer>,
    marked: usize,
    ticks: Vec<u64>,
    times: Vec<Duration>,
}

impl Timer {
    /// Makes a timer for this many marks, if the queue has a clock.
    pub(crate) fn new(gpu: &Arc<Gpu>, commands: &mut Commands, marks: usize) -> Result<Option<Self>, Error> {
        if gpu.timestamp_bits == 0 || marks == 0 {
            return Ok(None);
        }
        let kind = vk::QueryType::TIMESTAMP;
        let info = vk::QueryPoolCreateInfo::default().query_type(kind).query_count(marks as u32);
        // SAFETY: the device is open.
        let queries = gpu.checked("making a query pool", unsafe { gpu.raw().create_query_pool(&info, None) })?;
        let queries = Owned::new(gpu, queries);
        let mark = |query| {
            let mark = commands.make()?;
            commands.record(mark, |recorder| recorder.timestamp(queries.raw, query))?;
            Ok(mark)
        };
        let recorded = (0..marks as u32).map(mark).collect::<Result<_, Error>>()?;
        let (ticks, times) = (vec![0; marks], Vec::with_capacity(marks));
        Ok(Some(Self { gpu: Arc::clone(gpu), marks: recorded, marked: 0, ticks, times, queries }))
    }

    /// Forgets all marks.
    pub(crate) fn begin(&mut self) {
        self.marked = 0;
        self.times.clear();
    }

    /// The command buffer of the next mark, unless there is no room for more marks.
    pub(crate) fn mark(&mut self) -> Option<vk::CommandBuffer> {
        let mark = *self.marks.get(self.marked)?;
        self.marked += 1;
        Some(mark)
    }

    /// Reads the timestamps after all marks are done.
    pub(crate) fn finish(&mut self) -> Result<(), Error> {
        self.times.clear();
        let ticks = &mut self.ticks[..self.marked];
        if ticks.is_empty() {
            return Ok(());
        }
        let flags = vk::QueryResultFlags::TYPE_64;
        // SAFETY: the pool has this many queries, each of which returns 64 bits.
        let read = unsafe { self.gpu.raw().get_query_pool_results(self.queries.raw, 0, ticks, flags) };
        self.gpu.checked("reading the device's clock", read)?;
        let (bits, period) = (self.gpu.timestamp_bits, self.gpu.adapter.properties.limits.timestamp_period);
        self.times.extend(ticks.windows(2).map(|pair| between(pair[0], pair[1], bits, period)));
        Ok(())
    }

    /// The times between marks.
    pub(crate) fn times(&self) -> &[Duration] {
        &self.times
    }
}

/// The time between two readings of a clock with this many bits and a tick of `period` nanoseconds.
fn between(start: u64, end: u64, bits: u32, period: f32) -> Duration {
    // The other bits are 0 by the specification. If the clock wrapped around once, the difference is still right.
    let ticks = end.wrapping_sub(start) & (u64::MAX >> (64 - bits.min(64)));
    Duration::from_nanos((ticks as f64 * f64::from(period)) as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clocks_count_in_their_own_unit_and_run_over() {
        assert_eq!(between(5, 9, 64, 1.0), Duration::from_nanos(4));
        assert_eq!(between(u64::MAX, 2, 64, 10.0), Duration::from_nanos(30));
        assert_eq!(between((1 << 36) - 1, 1, 36, 52.5), Duration::from_nanos(105));
    }
}
