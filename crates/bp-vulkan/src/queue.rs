//! A program prepared on a device.
#![expect(unsafe_code, reason = "what the host sees of buffers is shared with the device")]

use std::{
    sync::{Arc, Mutex, PoisonError},
    time::{Duration, Instant},
};

use ash::vk;
use bp_core::Error;
use bp_gpu::{Buffer, Command, Memory, Program, Queue, Segment};

use crate::{
    buffers::Buffers,
    commands::{Commands, Recorder},
    gpu::Gpu,
    pipelines::Pipelines,
    resources::Resources,
    timeline::Timeline,
    timer::Timer,
};

/// A prepared program.
pub(crate) struct VulkanQueue {
    /// The first field is dropped first. Its drop waits for work that uses all other fields.
    timeline: Timeline,
    /// The command buffer of every segment.
    segments: Vec<vk::CommandBuffer>,
    /// A command buffer for rare work, which is recorded and run immediately.
    scratch: vk::CommandBuffer,
    /// Command buffers appended but not yet submitted.
    pending: Vec<vk::CommandBuffer>,
    /// The number of pieces of work submitted up to the last [`Queue::submit`].
    last_submit: u64,
    timer: Option<Timer>,
    commands: Commands,
    resources: Resources,
    gpu: Arc<Gpu>,
    compile_time: Duration,
}

impl VulkanQueue {
    /// Allocates, compiles, records and warms up.
    pub(crate) fn new(gpu: &Arc<Gpu>, pipelines: &Mutex<Pipelines>, program: &Program) -> Result<Self, Error> {
        let (resources, compile_time) = Resources::new(gpu, pipelines, program)?;
        let mut commands = Commands::new(gpu)?;
        let mut queue = Self {
            timeline: Timeline::new(gpu)?,
            segments: Vec::with_capacity(program.segments.len()),
            scratch: commands.make()?,
            pending: Vec::with_capacity(program.segments.len() + program.marks),
            last_submit: 0,
            timer: Timer::new(gpu, &mut commands, program.marks)?,
            commands,
            resources,
            gpu: Arc::clone(gpu),
            compile_time,
        };
        program.segments.iter().try_for_each(|segment| queue.record(segment))?;
        queue.start(program)?;
        if queue.warm_up(program)? {
            queue.start(program)?;
            pipelines.lock().unwrap_or_else(PoisonError::into_inner).store();
        }
        Ok(queue)
    }

    fn record(&mut self, segment: &Segment) -> Result<(), Error> {
        let commands = self.commands.make()?;
        self.commands.record(commands, |recorder| recorder.segment(&self.resources, &segment.commands))?;
        self.segments.push(commands);
        Ok(())
    }

    /// Clears the buffers on the device and writes the parameters.
    fn start(&mut self, program: &Program) -> Result<(), Error> {
        self.run(|recorder, resources| recorder.start(resources, &program.parameters))
    }

    /// Runs one workgroup of every pipeline that has never run. Returns whether there was such a pipeline.
    fn warm_up(&mut self, program: &Program) -> Result<bool, Error> {
        let before = Instant::now();
        let mut any = false;
        for command in program.segments.iter().flat_map(|segment| &segment.commands) {
            let Command::Dispatch { pipeline, bind_group, parameters, .. } = *command else { continue };
            if self.resources.pipelines[pipeline].is_warm() {
                continue;
            }
            let command = Command::Dispatch { pipeline, bind_group, parameters, workgroups: 1 };
            self.run(|recorder, resources| recorder.segment(resources, &[command]))?;
            self.resources.pipelines[pipeline].set_warm();
            any = true;
        }
        if any {
            self.compile_time += before.elapsed();
        }
        Ok(any)
    }

    /// Records commands and runs them immediately.
    fn run(&mut self, record: impl FnOnce(&Recorder<'_>, &Resources)) -> Result<(), Error> {
        self.timeline.wait_for_all()?;
        self.commands.record(self.scratch, |recorder| record(recorder, &self.resources))?;
        self.timeline.submit(&[self.scratch])?;
        self.timeline.wait_for_all()
    }

    fn push(&mut self, commands: vk::CommandBuffer) -> Result<(), Error> {
        // The list never grows, so it allocates nothing.
        if self.pending.len() == self.pending.capacity() {
            self.flush()?;
        }
        self.pending.push(commands);
        Ok(())
    }

    fn flush(&mut self) -> Result<(), Error> {
        if !self.pending.is_empty() {
            self.timeline.submit(&self.pending)?;
            self.pending.clear();
        }
        Ok(())
    }
}

impl Queue for VulkanQueue {
    fn begin(&mut self, fill: &mut dyn FnMut(&mut [u8])) -> Result<(), Error> {
        self.timeline.wait_for_all()?;
        self.pending.clear();
        if let Some(timer) = &mut self.timer {
            timer.begin();
        }
        // SAFETY: all work was waited for above.
        fill(unsafe { self.resources.buffers.host_mut(Program::UPLOAD) });
        Ok(())
    }

    fn append(&mut self, segment: usize) -> Result<(), Error> {
        self.push(self.segments[segment])
    }

    fn mark(&mut self) -> Result<(), Error> {
        match self.timer.as_mut().and_then(Timer::mark) {
            Some(mark) => self.push(mark),
            None => Ok(()),
        }
    }

    fn submit(&mut self) -> Result<(), Error> {
        self.flush()?;
        self.timeline.wait(self.last_submit)?;
        self.last_submit = self.timeline.submitted();
        Ok(())
    }

    fn finish(&mut self, read: &mut dyn FnMut(&[u8])) -> Result<(), Error> {
        self.flush()?;
        self.timeline.wait_for_all()?;
        if let Some(timer) = &mut self.timer {
            timer.finish()?;
        }
        // SAFETY: all work was waited for above.
        read(unsafe { self.resources.buffers.host(Program::DOWNLOAD) });
        Ok(())
    }

    fn times(&mut self) -> &[Duration] {
        self.timer.as_ref().map_or(&[], Timer::times)
    }

    fn read(&mut self, buffer: usize) -> Result<Vec<u8>, Error> {
        self.flush()?;
        let bytes = self.resources.buffers.size(buffer);
        let copy = Buffers::new(&self.gpu, &[Buffer { name: "a copy", bytes, memory: Memory::Download }])?;
        self.run(|recorder, resources| {
            recorder.barrier();
            let region = vk::BufferCopy { src_offset: 0, dst_offset: 0, size: bytes };
            recorder.copy(resources.buffers.raw(buffer), copy.raw(0), region);
            recorder.show_host();
        })?;
        // SAFETY: `run` waited for the copy.
        Ok(unsafe { copy.host(0) }.to_vec())
    }

    fn compile_time(&self) -> Duration {
        self.compile_time
    }

    fn allocated_bytes(&self) -> u64 {
        self.resources.buffers.bytes()
    }
}
