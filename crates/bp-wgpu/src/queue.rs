//! A program prepared on a device.

use std::{
    mem,
    sync::Arc,
    time::{Duration, Instant},
};

use bp_core::{Error, memory};
use bp_gpu::{Program, Queue};
use wgpu::{BufferUsages, CommandEncoder, SubmissionIndex};

use crate::{
    buffers,
    clock::Clock,
    gpu::Gpu,
    pipelines::Pipelines,
    recording::{self, Recording},
};

/// A program prepared on a device.
pub(crate) struct WgpuQueue {
    gpu: Arc<Gpu>,
    recording: Recording,
    clock: Option<Clock>,
    /// The data to upload. It needs its own memory: a function that fills a slice may read it, but wgpu's mapped memory
    /// cannot be read.
    upload: Vec<u8>,
    /// The encoder of commands that were appended but not yet submitted, if there are any.
    encoder: Option<CommandEncoder>,
    last: SubmissionIndex,
    compile_time: Duration,
    bytes: u64,
}

impl WgpuQueue {
    /// Allocates and clears buffers, and compiles kernels.
    pub(crate) fn new(gpu: &Arc<Gpu>, pipelines: &Pipelines, program: &Program) -> Result<Self, Error> {
        let buffers = buffers::make(gpu, program)?;
        let upload = memory::filled("what is uploaded", buffers[Program::UPLOAD].size() as usize, 0)?;
        let clock = Clock::new(gpu, program.marks)?;
        let (recording, compile_time) = compile(gpu, pipelines, program, buffers)?;
        let bytes = program.bytes() + upload.len() as u64 + clock.as_ref().map_or(0, Clock::bytes);
        let last = gpu.guard(bytes, || {
            let mut encoder = recording::encoder(gpu);
            buffers::clear(&mut encoder, program, &recording.buffers);
            let cleared = recording::submit(gpu, encoder);
            gpu.wait(&cleared)?;
            Ok(cleared)
        })?;
        Ok(Self { gpu: Arc::clone(gpu), recording, clock, upload, encoder: None, last, compile_time, bytes })
    }

    /// Submits the appended commands, and returns the previous submission.
    fn flush(&mut self) -> SubmissionIndex {
        match self.encoder.take() {
            Some(encoder) => mem::replace(&mut self.last, recording::submit(&self.gpu, encoder)),
            None => self.last.clone(),
        }
    }

    /// Runs `work` under [`Gpu::guard`].
    fn guard<T>(&mut self, work: impl FnOnce(&mut Self, &Gpu) -> Result<T, Error>) -> Result<T, Error> {
        let gpu = Arc::clone(&self.gpu);
        gpu.guard(self.bytes, || work(self, &gpu))
    }
}

/// The encoder of appended commands.
fn open<'a>(gpu: &Gpu, encoder: &'a mut Option<CommandEncoder>) -> &'a mut CommandEncoder {
    encoder.get_or_insert_with(|| recording::encoder(gpu))
}

/// Compiles the kernels of a program. Also returns the time that this took. Leaves arbitrary values in the buffers.
fn compile(
    gpu: &Gpu,
    pipelines: &Pipelines,
    program: &Program,
    buffers: Vec<wgpu::Buffer>,
) -> Result<(Recording, Duration), Error> {
    let start = Instant::now();
    let mut new = Vec::new();
    let mut compiled = Vec::new();
    for (index, pipeline) in program.pipelines.iter().enumerate() {
        let (pipeline, is_new) = pipelines.get(gpu, pipeline)?;
        new.extend(is_new.then_some(index));
        compiled.push(pipeline);
    }
    let recording = gpu.guard(program.bytes(), || {
        let recording = Recording::new(gpu, program, buffers, compiled);
        recording.warm_up(gpu, &new)?;
        Ok(recording)
    })?;
    let time = start.elapsed();
    if !new.is_empty() {
        pipelines.store();
    }
    Ok((recording, time))
}

impl Queue for WgpuQueue {
    fn begin(&mut self, fill: &mut dyn FnMut(&mut [u8])) -> Result<(), Error> {
        self.encoder = None;
        if let Some(clock) = &mut self.clock {
            clock.reset();
        }
        fill(&mut self.upload);
        self.guard(|this, gpu| buffers::write(gpu, &this.recording.buffers[Program::UPLOAD], &this.last, &this.upload))
    }

    fn append(&mut self, segment: usize) -> Result<(), Error> {
        self.guard(|this, gpu| {
            this.recording.encode(open(gpu, &mut this.encoder), segment);
            Ok(())
        })
    }

    fn mark(&mut self) -> Result<(), Error> {
        self.guard(|this, gpu| {
            if let Some(clock) = &mut this.clock {
                clock.mark(open(gpu, &mut this.encoder));
            }
            Ok(())
        })
    }

    fn submit(&mut self) -> Result<(), Error> {
        self.guard(|this, gpu| {
            let before = this.flush();
            gpu.wait(&before)
        })
    }

    fn finish(&mut self, read: &mut dyn FnMut(&[u8])) -> Result<(), Error> {
        self.guard(|this, gpu| {
            if let Some(clock) = &this.clock {
                clock.resolve(open(gpu, &mut this.encoder));
            }
            this.flush();
            buffers::read(gpu, &this.recording.buffers[Program::DOWNLOAD], &this.last, read)?;
            this.clock.as_mut().map_or(Ok(()), |clock| clock.read(gpu, &this.last))
        })
    }

    fn times(&mut self) -> &[Duration] {
        self.clock.as_ref().map_or(&[], Clock::times)
    }

    fn read(&mut self, buffer: usize) -> Result<Vec<u8>, Error> {
        self.guard(|this, gpu| {
            let source = &this.recording.buffers[buffer];
            let copy = buffers::buffer(gpu, "copy", source.size(), BufferUsages::MAP_READ | BufferUsages::COPY_DST);
            open(gpu, &mut this.encoder).copy_buffer_to_buffer(source, 0, &copy, 0, source.size());
            this.flush();
            buffers::read(gpu, &copy, &this.last, <[u8]>::to_vec)
        })
    }

    fn compile_time(&self) -> Duration {
        self.compile_time
    }

    fn allocated_bytes(&self) -> u64 {
        self.bytes
    }
}
