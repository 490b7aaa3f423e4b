//! The buffers of one plan, and the kernels that run on them.

use std::{mem, ops::Range};

use bp_core::{Error, IsStopped, Plan, Schedule, Seed, Side, Solver, Stage, StereoPair};
use fearless_simd::Level;

use crate::{
    coarsen::{coarsen, coarsen_unstored},
    costs::{self, Costs},
    features::{self, Features},
    half_steps::{self, Coarser, Edges, Labels, Last, Pass, Rows},
    layout::{self, Layout},
    match_cost::{Matching, match_cost},
    shape::Shape,
    stored::{is_made_with_next, is_stored},
    sweep::{self, CostSource, Grid, Passed, Swept},
};

/// A prepared plan.
pub(crate) struct RayonSolver {
    level: Level,
    plan: Plan,
    layouts: Vec<Layout>,
    features: Features,
    costs: Vec<Costs>,
    /// The messages of even grids and of odd ones: only a grid and the next coarser one are needed at the same time.
    messages: [Messages; 2],
    /// The labels, unless bands are swept.
    labels: Labels,
    swept: Swept,
    /// Whether grid 0 starts with the messages that it already holds.
    keeps_messages: bool,
    /// Whether grid 0 lacks the messages that the senders of its last half-step received; see [`Last::DecidesOnly`].
    lacks_messages: bool,
    seed: Option<Seed>,
    /// The most bytes to allocate.
    limit: u64,
}

/// The messages of one grid, in two sets.
///
/// A grid is bipartite. So a synchronous run consists of two independent runs of half-steps: in one the even nodes send
/// first, in the other the odd nodes. `sync` uses a set for each of them. `checkerboard` is only the first run; its
/// last half-step writes to the second set, so that the messages its senders received are not lost, if they are needed. `outward` has a set for
/// the messages that even nodes receive, and one for those of odd nodes. `sweep` keeps none here, see [`Swept`].
struct Messages {
    sets: [Edges; 2],
}

impl Messages {
    fn none() -> Self {
        Self { sets: [Edges::none(), Edges::none()] }
    }
}

/// Whether messages are kept in sets.
fn has_sets(plan: &Plan) -> bool {
    plan.settings().schedule != Schedule::Sweep
}

/// The bytes that a driver will allocate, including its labels, or with label sets the most that it may allocate.
pub(crate) fn planned_bytes(plan: &Plan) -> u64 {
    bytes(plan, plan.model().labels())
}

/// The bytes that a driver will probably allocate. Of public pairs with 64 to 240 labels, label sets hold less than this.
pub(crate) fn likely_bytes(plan: &Plan) -> u64 {
    let labels = plan.model().labels();
    bytes(plan, labels.min(16 + labels / 5))
}

/// The bytes that a driver will allocate, if label sets hold this many labels.
fn bytes(plan: &Plan, labels: usize) -> u64 {
    let stored = (0..plan.grids()).filter(|&grid| is_stored(plan, grid));
    let costs = stored.map(|grid| costs::bytes(plan, grid));
    let kept = (0..plan.grids().min(2)).filter(|_| has_sets(plan));
    let messages = kept.map(|grid| half_steps::bytes(&Shape::new(plan, grid)).saturating_mul(2));
    let layouts = (0..plan.grids()).map(|grid| layout::bytes(plan, grid));
    let (features, answer) = (features::bytes(plan), (size_of::<u16>() * plan.image_size().pixels()) as u64);
    let decided = if has_sets(plan) { half_steps::labels_bytes(&Shape::new(plan, 0)) } else { 0 };
    let others = [features, answer, decided, sweep::bytes(plan, labels)];
    costs.chain(messages).chain(layouts).chain(others).fold(0, u64::saturating_add)
}

impl RayonSolver {
    /// Allocates all buffers.
    pub(crate) fn new(level: Level, plan: &Plan, is_stopped: IsStopped<'_>) -> Result<Self, Error> {
        let has_set = |grid| has_sets(plan) && grid < plan.grids();
        let set = |grid| if has_set(grid) { Edges::new(plan, grid, is_stopped) } else { Ok(Edges::none()) };
        let messages = |grid| Ok::<_, Error>(Messages { sets: [set(grid)?, set(grid)?] });
        let costs = |grid| if is_stored(plan, grid) { Costs::new(plan, grid, is_stopped) } else { Ok(Costs::none()) };
        Ok(Self {
            level,
            layouts: (0..plan.grids()).map(|grid| Layout::new(plan, grid)).collect::<Result<_, _>>()?,
            features: Features::new(plan)?,
            costs: (0..plan.grids()).map(costs).collect::<Result<_, _>>()?,
            messages: [messages(0)?, messages(1)?],
            labels: if has_sets(plan) { Labels::new(plan)? } else { Labels::none() },
            swept: Swept::new(plan)?,
            keeps_messages: false,
            lacks_messages: false,
            seed: None,
            limit: u64::MAX,
            plan: plan.clone(),
        })
    }

    fn matching(&self) -> Matching<'_> {
        let Self { level, plan, layouts, features, seed, .. } = self;
        Matching { level: *level, plan, layout: &layouts[0], features, seed: *seed }
    }

    /// A grid, ready to be swept, and what is swept.
    fn grid(&self, index: usize) -> Grid<'_> {
        let Self { level, plan, layouts, costs, .. } = self;
        let source = if is_stored(plan, index) {
            CostSource::Stored(&costs[index])
        } else {
            CostSource::Computed(self.matching())
        };
        Grid { level: *level, plan, index, layouts, costs: source }
    }

    /// The messages that a grid starts with.
    fn coarser(&self, grid: usize) -> Option<Coarser<'_>> {
        let layout = self.layouts.get(grid + 1)?;
        Some(Coarser { layout, received: received(&self.plan, layout, &self.messages[(grid + 1) % 2]) })
    }

    /// What the last step of a grid does. After an even number of half-steps, the next frame of a video starts with messages that
    /// are there in any case. A frame that starts with messages keeps all, because they could not be computed again.
    fn last(&self, grid: usize) -> Last {
        let settings = self.plan.settings();
        match grid {
            0 if self.keeps_messages || settings.steps % 2 == 1 || settings.schedule != Schedule::Checkerboard => {
                Last::Decides
            }
            0 => Last::DecidesOnly,
            _ => Last::Keeps,
        }
    }

    /// Passes messages in half-steps or loops.
    fn run_steps(&mut self, grid: usize, steps: Range<u32>, last: Last) {
        let mut messages = mem::replace(&mut self.messages[grid % 2], Messages::none());
        let mut labels = mem::replace(&mut self.labels, Labels::none());
        let (layout, costs) = (&self.layouts[grid], &self.costs[grid].stored);
        let coarser = self.coarser(grid);
        let keeps_messages = grid == 0 && self.keeps_messages;
        let pass = Pass { level: self.level, plan: &self.plan, layout, costs, coarser, keeps_messages, last };
        half_steps::run(&pass, steps.start as usize..steps.end as usize, &mut messages.sets, &mut labels);
        self.messages[grid % 2] = messages;
        self.labels = labels;
        self.lacks_messages = last == Last::DecidesOnly;
    }
}

/// The last messages that the nodes of a grid received, by checkerboard colour.
fn received<'a>(plan: &Plan, layout: &'a Layout, messages: &'a Messages) -> [Rows<'a>; 2] {
    received_in(plan).map(|set| messages.sets[set].rows(layout))
}

/// The sets that hold these messages.
fn received_in(plan: &Plan) -> [usize; 2] {
    let steps = plan.settings().steps as usize;
    [0, 1].map(|colour| match plan.settings().schedule {
        Schedule::Sync => (colour + steps) % 2,
        Schedule::Checkerboard => usize::from(colour == steps % 2),
        // Nothing is kept.
        Schedule::Sweep => 0,
        Schedule::Outward { .. } => colour,
    })
}

impl Solver for RayonSolver {
    fn match_cost(&mut self, pair: &StereoPair, seed: Option<Seed>) -> Result<(), Error> {
        self.swept.forget();
        self.features.load(self.level, pair);
        self.layouts[0].greys.load(self.level, pair.left(), self.plan.margin());
        self.seed = seed;
        if is_stored(&self.plan, 0) {
            let mut costs = mem::replace(&mut self.costs[0], Costs::none());
            match_cost(&self.matching(), &mut costs);
            self.costs[0] = costs;
        }
        Ok(())
    }

    fn coarsen(&mut self, grid: usize) -> Result<(), Error> {
        let [mut fine, mut coarse] = [grid - 1, grid].map(|grid| mem::replace(&mut self.costs[grid], Costs::none()));
        let layouts = [&self.layouts[grid - 1], &self.layouts[grid]];
        if !is_stored(&self.plan, grid) || is_made_with_next(&self.plan, grid) {
            // Its costs are computed when needed, or with those of the next grid.
        } else if is_stored(&self.plan, grid - 1) && !is_made_with_next(&self.plan, grid - 1) {
            coarsen(self.level, &self.plan, grid, layouts, &fine, &mut coarse);
        } else {
            coarsen_unstored(&self.matching(), self.swept.windows(), grid, layouts, &mut fine, &mut coarse);
        }
        self.costs[grid - 1] = fine;
        self.costs[grid] = coarse;
        let (fine, coarse) = self.layouts.split_at_mut(grid);
        coarse[0].greys.coarsen(self.level, &fine[grid - 1].greys);
        Ok(())
    }

    /// Copies nothing: nodes read their first messages just before they first send; see [`crate::refine`].
    fn refine(&mut self, _grid: usize) -> Result<(), Error> {
        self.keeps_messages = false;
        Ok(())
    }

    /// Even nodes send first, in the first set. So the set with the messages they received last must become the first.
    fn keep_messages(&mut self) -> Result<(), Error> {
        let [of_even, _] = received_in(&self.plan);
        self.messages[0].sets.rotate_left(if self.lacks_messages { 0 } else { of_even });
        self.keeps_messages = true;
        Ok(())
    }

    /// Under `sweep`, [`Self::pass_messages`] has done all.
    fn update_messages(&mut self, grid: usize, steps: Range<u32>) -> Result<(), Error> {
        if has_sets(&self.plan) {
            self.run_steps(grid, steps, self.last(grid));
        }
        Ok(())
    }

    /// Grids overlap in sweeps only.
    fn pass_messages(&mut self, grids: Range<usize>, passed: &mut Passed<'_>) -> Result<bool, Error> {
        let is_swept = self.plan.settings().schedule == Schedule::Sweep;
        if is_swept {
            self.sweep(grids, passed)?;
        }
        Ok(is_swept)
    }

    /// Only hands the labels out. They are decided in the last step, while messages are in cache.
    fn select_labels(&mut self, grid: usize, labels: &mut [u16]) -> Result<(), Error> {
        match self.plan.settings().schedule {
            Schedule::Sweep => self.swept.read_labels(&self.plan, grid, labels),
            Schedule::Sync | Schedule::Checkerboard | Schedule::Outward { .. } => {
                self.labels.hand_out(&self.layouts[0], labels);
            }
        }
        Ok(())
    }

    /// Passes the messages of grid 0 once more, if some of them were not kept, and under `sweep` those of all grids.
    fn read_messages(&mut self, side: Side, messages: &mut [u8]) -> Result<(), Error> {
        if self.plan.settings().schedule == Schedule::Sweep {
            let mut swept = mem::take(&mut self.swept);
            let result = swept.read_messages(&self.plan, |index| self.grid(index), side, messages);
            self.swept = swept;
            return result;
        }
        if self.lacks_messages {
            self.run_steps(0, 0..self.plan.settings().steps, Last::Decides);
        }
        let received = received(&self.plan, &self.layouts[0], &self.messages[0]);
        half_steps::read_messages(&self.plan, received, side, messages);
        Ok(())
    }

    fn fused_steps(&self) -> u32 {
        match self.plan.settings().schedule {
            Schedule::Sweep => u32::MAX,
            Schedule::Sync | Schedule::Checkerboard | Schedule::Outward { .. } => {
                half_steps::steps_at_a_time(&self.layouts[0]) as u32
            }
        }
    }

    /// Refining is part of updating: the first step on a grid reads the coarser grid's messages instead of its own. Over all
    /// grids, this saves reading the messages of one step on the finest grid. Deciding labels is part of it, too.
    fn moved_bytes(&self) -> Option<[u64; Stage::ALL.len()]> {
        let [match_cost, coarsen, _, update_messages, select_labels] = self.plan.moved_bytes()?;
        let handed_out = 4 * self.plan.image_size().pixels() as u64;
        let update_messages = update_messages - self.plan.updates_per_step(0) + select_labels;
        Some([match_cost, coarsen, 0, update_messages, handed_out])
    }

    fn message_updates(&self) -> Option<u64> {
        self.plan.has_label_sets(0).then(|| self.swept.updates())
    }

    fn allocated_bytes(&self) -> u64 {
        let costs: u64 = self.costs.iter().map(Costs::bytes).sum();
        let messages: u64 = self.messages.iter().flat_map(|messages| &messages.sets).map(Edges::bytes).sum();
        let layouts: u64 = self.layouts.iter().map(Layout::bytes).sum();
        self.features.bytes() + costs + messages + layouts + self.labels.bytes() + self.swept.bytes()
    }

    fn limit_bytes(&mut self, bytes: u64) {
        self.limit = bytes;
    }
}

impl RayonSolver {
    /// Sweeps these grids, if there is room.
    fn sweep(&mut self, grids: Range<usize>, passed: &mut Passed<'_>) -> Result<(), Error> {
        let mut swept = mem::take(&mut self.swept);
        let room = self.limit.saturating_sub(self.allocated_bytes());
        let result = swept.run(&self.plan, grids, |index| self.grid(index), room, passed);
        self.swept = swept;
        result
    }
}
