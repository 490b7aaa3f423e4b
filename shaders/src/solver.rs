//! A prepared plan on a device of any API.

use std::{ops::Range, time::Duration};

use bp_core::{Error, Plan, Seed, Side, Solver, Stage, StereoPair};

use crate::{Program, Queue, answer, compose, program::SegmentOf};

/// Runs the program of a plan on a queue, segment after segment, and hands over what has gathered whenever that is
/// enough work.
pub struct GpuSolver {
    plan: Plan,
    program: Program,
    queue: Box<dyn Queue>,
    /// The stage of the segments between each mark and the next.
    stages: Vec<Stage>,
    /// Message entries appended and not submitted.
    pending: u64,
    times: Option<[Duration; Stage::ALL.len()]>,
    moved_bytes: [u64; Stage::ALL.len()],
}

impl GpuSolver {
    /// A solver that runs `program`, which was made for `plan` and is ready on `queue`.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn new(plan: &Plan, program: Program, queue: Box<dyn Queue>) -> Result<Self, Error> {
        let mut stages = bp_core::memory::filled("stages", program.marks, Stage::MatchCost)?;
        stages.clear();
        Ok(Self {
            plan: plan.clone(),
            program,
            queue,
            stages,
            pending: 0,
            times: None,
            moved_bytes: [0; Stage::ALL.len()],
        })
    }

    /// Appends segments of one stage, and a mark behind them.
    fn run(&mut self, stage: Stage, segments: impl Iterator<Item = SegmentOf>) -> Result<(), Error> {
        for segment in segments {
            let segment = self.program.segment(segment);
            self.moved_bytes[stage as usize] += self.program.segments[segment].moved_bytes;
            self.queue.append(segment)?;
        }
        if self.stages.len() < self.stages.capacity() {
            self.stages.push(stage);
        }
        self.queue.mark()
    }
}

impl Solver for GpuSolver {
    fn match_cost(&mut self, pair: &StereoPair, seed: Option<Seed>) -> Result<(), Error> {
        self.stages.clear();
        self.pending = 0;
        self.times = None;
        self.moved_bytes = [0; Stage::ALL.len()];
        self.queue.begin(&mut |upload| answer::write_pair(pair, seed, upload))?;
        self.queue.mark()?;
        self.run(Stage::MatchCost, [SegmentOf::MatchCost].into_iter())
    }

    fn coarsen(&mut self, grid: usize) -> Result<(), Error> {
        self.run(Stage::Coarsen, [SegmentOf::Coarsen(grid)].into_iter())
    }

    fn refine(&mut self, grid: usize) -> Result<(), Error> {
        self.run(Stage::Refine, [SegmentOf::Refine(grid)].into_iter())
    }

    fn update_messages(&mut self, grid: usize, steps: Range<u32>) -> Result<(), Error> {
        let count = u64::from(steps.end.saturating_sub(steps.start));
        self.run(Stage::UpdateMessages, steps.map(|step| SegmentOf::UpdateMessages(grid, step)))?;
        self.pending += count * self.plan.updates_per_step(grid);
        if self.pending >= self.program.submission_entries {
            self.pending = 0;
            self.queue.submit()?;
        }
        Ok(())
    }

    fn select_labels(&mut self, labels: &mut [u16]) -> Result<(), Error> {
        self.run(Stage::SelectLabels, [SegmentOf::SelectLabels].into_iter())?;
        let size = self.plan.image_size();
        self.queue.finish(&mut |download| answer::read_labels(size, download, labels))?;
        let between = self.queue.times();
        self.times = (between.len() == self.stages.len()).then(|| {
            let mut times = [Duration::ZERO; Stage::ALL.len()];
            self.stages.iter().zip(between).for_each(|(&stage, &time)| times[stage as usize] += time);
            times
        });
        Ok(())
    }

    fn read_messages(&mut self, side: Side, messages: &mut [u8]) -> Result<(), Error> {
        answer::read_messages(&self.plan, &self.program, self.queue.as_mut(), side, messages)
    }

    fn fused_steps(&self) -> u32 {
        compose::fused_steps(&self.plan, self.program.submission_entries)
    }

    fn device_times(&mut self) -> Option<[Duration; Stage::ALL.len()]> {
        self.times
    }

    fn moved_bytes(&self) -> Option<[u64; Stage::ALL.len()]> {
        Some(self.moved_bytes)
    }

    fn compile_time(&self) -> Option<Duration> {
        Some(self.queue.compile_time())
    }

    fn allocated_bytes(&self) -> u64 {
        self.queue.allocated_bytes()
    }
}
