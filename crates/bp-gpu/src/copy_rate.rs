//! Measures how fast a device copies its own memory: an upper bound for its kernels.

use std::time::{Duration, Instant};

use bp_core::Error;

use crate::{Buffer, Command, Limits, Memory, Program, Queue, Segment};

/// The bytes of a copy, if buffers may be that large: more than any cache holds.
const BYTES: u64 = 256 << 20;
/// The number of timed copies after one warm-up copy. The median counts.
const COPIES: usize = 9;

/// Measures the total bytes per second that a device reads and writes. `prepare` prepares a program on the device.
///
/// # Errors
/// Errors of the device.
pub fn copy_rate(
    limits: &Limits,
    prepare: impl FnOnce(&Program) -> Result<Box<dyn Queue>, Error>,
) -> Result<f64, Error> {
    let memory = limits.memory_bytes.unwrap_or(u64::MAX);
    let bytes = BYTES.min(limits.buffer_bytes).min(memory / 4) / 256 * 256;
    let mut queue = prepare(&program(bytes))?;
    let mut times = [Duration::ZERO; COPIES];
    time(queue.as_mut())?;
    for time_of_copy in &mut times {
        *time_of_copy = time(queue.as_mut())?;
    }
    times.sort_unstable();
    Ok(2.0 * bytes as f64 / times[COPIES / 2].as_secs_f64().max(f64::MIN_POSITIVE))
}

/// The time of a copy by the device's clock, or by the host's if it has none.
fn time(queue: &mut dyn Queue) -> Result<Duration, Error> {
    queue.begin(&mut |_| ())?;
    let start = Instant::now();
    queue.mark()?;
    queue.append(0)?;
    queue.mark()?;
    queue.finish(&mut |_| ())?;
    let elapsed = start.elapsed();
    Ok(queue.times().first().copied().unwrap_or(elapsed))
}

/// A program that copies one buffer to another.
fn program(bytes: u64) -> Program {
    let buffer = |name, bytes, memory| Buffer { name, bytes, memory };
    let copy = Command::Copy { from: 3, from_offset: 0, to: 4, to_offset: 0, bytes };
    Program {
        buffers: vec![
            buffer("parameters", 256, Memory::Device),
            buffer("upload", 256, Memory::Upload),
            buffer("download", 256, Memory::Download),
            buffer("copied", bytes, Memory::Device),
            buffer("copy", bytes, Memory::Device),
        ],
        parameters: vec![0; 256],
        pipelines: Vec::new(),
        bind_groups: Vec::new(),
        segments: vec![Segment { commands: vec![copy], entries: 0, moved_bytes: 2 * bytes }],
        periods: 1,
        parts: Vec::new(),
        marks: 2,
        submission_entries: 1,
        grids: Vec::new(),
        last_sent: Vec::new(),
        costs: Vec::new(),
    }
}
