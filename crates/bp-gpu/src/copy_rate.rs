//! Measures how fast a kernel copies a device's memory: an upper bound for other kernels. The copies of an API may be slower: an
//! NVIDIA H100 leaves them to an engine with a quarter of that rate.

use std::time::{Duration, Instant};

use bp_core::Error;

use crate::{
    BindGroup, Buffer, Command, Kernel, Limits, Memory, Parameters, Pipeline, Program, Queue, Segment, WORKGROUP,
};

/// The bytes of a copy, if buffers may be that large: more than any cache holds.
const BYTES: u64 = 256 << 20;
/// The number of timed copies after one warm-up copy. The median counts.
const COPIES: usize = 9;
/// The most workgroups of a copy.
const WORKGROUPS: u32 = 1 << 15;
/// The bytes that a workgroup copies of a row: a vector for each invocation.
const GROUP_BYTES: u64 = 16 * WORKGROUP as u64;

/// Measures the total bytes per second that a device reads and writes. `prepare` prepares a program on the device.
///
/// # Errors
/// Errors of the device.
pub fn copy_rate(
    limits: &Limits,
    prepare: impl FnOnce(&Program) -> Result<Box<dyn Queue>, Error>,
) -> Result<f64, Error> {
    let memory = limits.memory_bytes.unwrap_or(u64::MAX);
    let most = BYTES.min(limits.buffer_bytes).min(limits.binding_bytes).min(memory / 4);
    let workgroups = u64::from(limits.workgroups.min(WORKGROUPS)).min(most / GROUP_BYTES).max(1);
    let rows = (most / (workgroups * GROUP_BYTES)).max(1);
    let bytes = rows * workgroups * GROUP_BYTES;
    let mut queue = prepare(&program(workgroups as u32, rows as u32))?;
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

/// A program that copies one buffer to another: this many rows, of which every workgroup copies a part.
fn program(workgroups: u32, rows: u32) -> Program {
    let words = workgroups * WORKGROUP;
    let bytes = u64::from(rows) * u64::from(workgroups) * GROUP_BYTES;
    let buffer = |name, bytes, memory| Buffer { name, bytes, memory };
    let mut parameters = bytemuck::bytes_of(&Parameters { words, rows, ..Parameters::default() }).to_vec();
    parameters.resize(256, 0);
    let copy = Command::Dispatch { pipeline: 0, bind_group: 0, parameters: 0, workgroups };
    Program {
        buffers: vec![
            buffer("parameters", 256, Memory::Device),
            buffer("upload", 256, Memory::Upload),
            buffer("download", 256, Memory::Download),
            buffer("copied", bytes, Memory::Device),
            buffer("copy", bytes, Memory::Device),
        ],
        parameters,
        pipelines: vec![Pipeline { kernel: Kernel::Copy, constants: Vec::new() }],
        bind_groups: vec![BindGroup { kernel: Kernel::Copy, buffers: vec![4, 3] }],
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
