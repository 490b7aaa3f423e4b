//! The solver of all GPU backends.

use std::{ops::Range, time::Duration};

use bp_core::{Error, Plan, Schedule, Seed, Settings, Side, Solver, Stage, StereoPair};

use crate::{Program, Queue, answer, compose, program::Part};

/// Runs the program of a plan on a queue. It appends segments and submits them whenever they amount to enough work.
pub struct GpuSolver {
    plan: Plan,
    program: Program,
    queue: Box<dyn Queue>,
    /// The stage of the segments between each mark and the next.
    stages: Vec<Stage>,
    /// The message entries appended but not yet submitted.
    pending: u64,
    times: Option<[Duration; Stage::ALL.len()]>,
    moved_bytes: [u64; Stage::ALL.len()],
}

impl GpuSolver {
    /// Makes a solver that runs `program`, which was made for `plan` and prepared on `queue`.
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

    /// Appends parts of one stage, then a mark. Submits before the appended work grows too large.
    fn run(&mut self, stage: Stage, parts: impl Iterator<Item = Part>) -> Result<(), Error> {
        for index in parts.flat_map(|part| self.program.segments_of(part)) {
            let segment = &self.program.segments[index];
            if self.pending > 0 && self.pending + segment.entries > self.program.submission_entries {
                self.queue.submit()?;
                self.pending = 0;
            }
            self.queue.append(index)?;
            self.pending += segment.entries;
            self.moved_bytes[stage as usize] += segment.moved_bytes;
        }
        if self.stages.len() < self.stages.capacity() {
            self.stages.push(stage);
        }
        self.queue.mark()
    }
}

/// Checks that after a solve of the plan, the messages are where the first step of the next one reads them. After an odd number
/// of synchronous loops they are not: the last loop wrote to the buffers that the first loop would write to.
///
/// # Errors
/// [`Error::Unsupported`].
pub fn check_warm(plan: &Plan) -> Result<(), Error> {
    let Settings { schedule, steps, .. } = *plan.settings();
    if schedule == Schedule::Sync && steps % 2 == 1 {
        let reason = "a warm start needs an even number of loops here, or the schedule checkerboard".to_owned();
        return Err(Error::Unsupported { device: "the GPU".to_owned(), reason });
    }
    Ok(())
}

impl Solver for GpuSolver {
    fn match_cost(&mut self, pair: &StereoPair, seed: Option<Seed>) -> Result<(), Error> {
        self.stages.clear();
        self.pending = 0;
        self.times = None;
        self.moved_bytes = [0; Stage::ALL.len()];
        self.queue.begin(&mut |upload| answer::write_pair(pair, seed, upload))?;
        self.queue.mark()?;
        self.run(Stage::MatchCost, [Part::MatchCost].into_iter())
    }

    fn coarsen(&mut self, grid: usize) -> Result<(), Error> {
        self.run(Stage::Coarsen, [Part::Coarsen(grid)].into_iter())
    }

    fn refine(&mut self, grid: usize) -> Result<(), Error> {
        self.run(Stage::Refine, [Part::Refine(grid)].into_iter())
    }

    fn keep_messages(&mut self) -> Result<(), Error> {
        check_warm(&self.plan)
    }

    fn update_messages(&mut self, grid: usize, steps: Range<u32>) -> Result<(), Error> {
        self.run(Stage::UpdateMessages, steps.map(|step| Part::UpdateMessages(grid, step)))
    }

    fn select_labels(&mut self, grid: usize, labels: &mut [u16]) -> Result<(), Error> {
        self.run(Stage::SelectLabels, [Part::SelectLabels(grid)].into_iter())?;
        let size = self.plan.size(grid);
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

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use bp_core::{Algorithm, Model, Profile, Schedule};
    use bp_testkit::noise_pair;

    use super::*;
    use crate::Limits;

    /// Records the message entries of each submission, and returns zeros as results.
    struct Counter {
        entries: Vec<u64>,
        download: Vec<u8>,
        pending: u64,
        submitted: Arc<Mutex<Vec<u64>>>,
    }

    impl Queue for Counter {
        fn begin(&mut self, _: &mut dyn FnMut(&mut [u8])) -> Result<(), Error> {
            Ok(())
        }

        fn append(&mut self, segment: usize) -> Result<(), Error> {
            self.pending += self.entries[segment];
            Ok(())
        }

        fn mark(&mut self) -> Result<(), Error> {
            Ok(())
        }

        fn submit(&mut self) -> Result<(), Error> {
            self.submitted.lock().unwrap().push(std::mem::take(&mut self.pending));
            Ok(())
        }

        fn finish(&mut self, read: &mut dyn FnMut(&[u8])) -> Result<(), Error> {
            self.submit()?;
            read(&self.download);
            Ok(())
        }

        fn times(&mut self) -> &[Duration] {
            &[]
        }

        fn read(&mut self, _: usize) -> Result<Vec<u8>, Error> {
            Ok(Vec::new())
        }

        fn compile_time(&self) -> Duration {
            Duration::ZERO
        }

        fn allocated_bytes(&self) -> u64 {
            0
        }
    }

    /// The message entries of each submission of a solve, and the most that one may have.
    fn submissions(plan: &Plan, dispatch_entries: u64) -> (Vec<u64>, u64) {
        let limits = Limits { dispatch_entries, ..Limits::roomy() };
        let program = Program::new(plan, &limits).unwrap();
        let submitted = Arc::new(Mutex::new(Vec::new()));
        let counter = Counter {
            entries: program.segments.iter().map(|segment| segment.entries).collect(),
            download: vec![0; program.buffers[Program::DOWNLOAD].bytes as usize],
            pending: 0,
            submitted: Arc::clone(&submitted),
        };
        let most = program.submission_entries;
        let mut solver = GpuSolver::new(plan, program, Box::new(counter)).unwrap();
        let pair = noise_pair(plan.image_size().width, plan.image_size().height, 1);
        solver.match_cost(&pair, None).unwrap();
        (1..plan.grids()).for_each(|grid| solver.coarsen(grid).unwrap());
        for grid in (0..plan.grids()).rev() {
            solver.refine(grid).unwrap();
            solver.update_messages(grid, 0..plan.settings().steps).unwrap();
        }
        solver.select_labels(0, &mut vec![0; plan.image_size().pixels()]).unwrap();
        (submitted.lock().unwrap().clone(), most)
    }

    /// No submission keeps a watchdog waiting for more than a few dispatches, and few submissions are nearly empty.
    #[test]
    fn submissions_are_neither_long_nor_many() {
        let pair = noise_pair(60, 70, 1);
        for (algorithm, schedule) in Algorithm::ALL.into_iter().flat_map(|a| Schedule::ALL.map(|s| (a, s))) {
            let settings = algorithm.settings(pair.size(), 30, 2, schedule);
            let plan = Plan::new(pair.size(), Model::new(Profile::Census, 16).unwrap(), settings).unwrap();
            let (submitted, most) = submissions(&plan, 1 << 14);
            assert!(submitted.iter().all(|&entries| entries <= most), "{submitted:?} {plan:?}");
            let half_full = submitted.iter().filter(|&&entries| 2 * entries >= most).count();
            assert!(2 * half_full + 1 >= submitted.len(), "{submitted:?} {plan:?}");
            assert_eq!(submissions(&plan, 1 << 40).0.len(), 1);
        }
    }
}
