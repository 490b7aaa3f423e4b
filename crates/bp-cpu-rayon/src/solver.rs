//! The buffers of one plan, and the kernels that run on them.

use std::ops::Range;

use bp_core::{Error, Plan, Schedule, Seed, Side, Solver, Stage, StereoPair, memory};
use fearless_simd::Level;

use crate::{
    coarsen::{coarsen, coarsen_unstored},
    costs::{self, Costs},
    edges::{self, Edges, Rows},
    features::{self, Features},
    half_steps,
    layout::{self, Layout},
    match_cost::{Matching, is_stored, match_cost},
    pass::Pass,
    refine::Coarser,
    seams::{self, Seams},
    select_labels::{Answer, select_labels},
    shape::Shape,
    sweep::{CostSource, Sweep},
    windows::{self, Windows},
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
    windows: Windows,
    seams: Seams,
    /// Whether grid 0 starts with the messages that it already holds.
    keeps_messages: bool,
    seed: Option<Seed>,
    /// The labels of a swept image. They are decided while its messages are in cache.
    decided: Vec<u16>,
}

/// The messages of one grid. A set has one message per edge, and a schedule needs one or two sets.
///
/// A grid is bipartite. So a synchronous run consists of two independent runs of half-steps: in one the even nodes send
/// first, in the other the odd nodes. `sync` uses a set for each of them. `checkerboard` is only the first run; its
/// last half-step writes to the second set, so that the messages its senders received are not lost. `sweep` keeps one
/// message per edge by definition.
struct Messages {
    sets: [Edges; 2],
}

impl Messages {
    fn none() -> Self {
        Self { sets: [Edges::none(), Edges::none()] }
    }
}

/// The number of sets of messages that a grid keeps. Grid 0 keeps none under `sweep`.
fn sets(plan: &Plan, grid: usize) -> usize {
    match plan.settings().schedule {
        Schedule::Sweep => usize::from(grid > 0),
        Schedule::Sync | Schedule::Checkerboard => 2,
    }
}

/// The two grids whose messages need the most memory: the finest grids of even and of odd index that keep any.
fn largest(plan: &Plan) -> [usize; 2] {
    if sets(plan, 0) == 0 { [2, 1] } else { [0, 1] }
}

/// The bytes that a solver will allocate.
pub(crate) fn planned_bytes(plan: &Plan) -> u64 {
    let stored = (0..plan.grids()).filter(|&grid| is_stored(plan, grid));
    let costs = stored.map(|grid| costs::bytes(plan, grid));
    let kept = largest(plan).into_iter().filter(|&grid| grid < plan.grids());
    let messages = kept.map(|grid| edges::bytes(&Shape::new(plan, grid)) as u64 * sets(plan, grid) as u64);
    let labels = 2 * plan.image_size().pixels() as u64;
    let decided = if plan.settings().schedule == Schedule::Sweep { labels } else { 0 };
    let layouts = (0..plan.grids()).map(|grid| layout::bytes(plan, grid));
    let features = features::bytes(plan.image_size(), plan.model());
    let others = [labels, decided, features, windows::bytes(plan), seams::bytes(plan)];
    costs.chain(messages).chain(layouts).chain(others).fold(0, u64::saturating_add)
}

impl RayonSolver {
    /// Allocates all buffers.
    pub(crate) fn new(level: Level, plan: &Plan) -> Result<Self, Error> {
        let set = |grid, set| {
            let needed = grid < plan.grids() && set < sets(plan, grid);
            if needed { Edges::new(plan, grid) } else { Ok(Edges::none()) }
        };
        let messages = |grid| Ok::<_, Error>(Messages { sets: [set(grid, 0)?, set(grid, 1)?] });
        let costs = |grid| if is_stored(plan, grid) { Costs::new(plan, grid) } else { Ok(Costs::none()) };
        let [even, odd] = largest(plan);
        let decided = if plan.settings().schedule == Schedule::Sweep { plan.image_size().pixels() } else { 0 };
        Ok(Self {
            level,
            layouts: (0..plan.grids()).map(|grid| Layout::new(plan, grid)).collect::<Result<_, _>>()?,
            features: Features::new(plan.image_size(), plan.model())?,
            costs: (0..plan.grids()).map(costs).collect::<Result<_, _>>()?,
            messages: [messages(even)?, messages(odd)?],
            windows: Windows::new(plan)?,
            seams: Seams::new(plan)?,
            keeps_messages: false,
            seed: None,
            decided: memory::filled("labels", decided, 0)?,
            plan: plan.clone(),
        })
    }

    fn matching(&self) -> Matching<'_> {
        let Self { level, plan, layouts, features, seed, .. } = self;
        Matching { level: *level, plan, layout: &layouts[0], features, seed: *seed }
    }

    /// A grid, ready to be swept.
    fn sweep(&self, grid: usize) -> Sweep<'_> {
        let Self { level, plan, layouts, windows, .. } = self;
        let costs = if is_stored(plan, grid) {
            CostSource::Stored(&self.costs[grid].stored)
        } else {
            CostSource::Computed(self.matching())
        };
        let coarser = self.coarser(grid);
        Sweep { level: *level, plan, layout: &layouts[grid], costs, coarser, windows }
    }

    /// The messages that a grid starts with.
    fn coarser(&self, grid: usize) -> Option<Coarser<'_>> {
        let layout = self.layouts.get(grid + 1)?;
        Some(Coarser { layout, received: received(&self.plan, layout, &self.messages[(grid + 1) % 2]) })
    }

    fn answer(&self) -> Answer<'_> {
        let (level, model, layout) = (self.level, self.plan.model(), &self.layouts[0]);
        let received = received(&self.plan, layout, &self.messages[0]);
        Answer { level, model, layout, first: 0, stored: &self.costs[0].stored, received }
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
        Schedule::Sweep => 0,
    })
}

impl Solver for RayonSolver {
    fn match_cost(&mut self, pair: &StereoPair, seed: Option<Seed>) -> Result<(), Error> {
        self.features.load(self.level, pair);
        self.layouts[0].greys.load(self.level, pair.left());
        self.seed = seed;
        if is_stored(&self.plan, 0) {
            let mut costs = std::mem::replace(&mut self.costs[0], Costs::none());
            match_cost(&self.matching(), &mut costs);
            self.costs[0] = costs;
        }
        Ok(())
    }

    fn coarsen(&mut self, grid: usize) -> Result<(), Error> {
        let mut coarse = std::mem::replace(&mut self.costs[grid], Costs::none());
        if is_stored(&self.plan, grid - 1) {
            let layouts = [&self.layouts[grid - 1], &self.layouts[grid]];
            coarsen(self.level, &self.plan, grid, layouts, &self.costs[grid - 1], &mut coarse);
        } else {
            coarsen_unstored(&self.matching(), &self.windows, &self.layouts[grid], &mut coarse);
        }
        self.costs[grid] = coarse;
        let (fine, coarse) = self.layouts.split_at_mut(grid);
        coarse[0].greys.coarsen(&fine[grid - 1].greys);
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
        self.messages[0].sets.rotate_left(of_even);
        self.keeps_messages = true;
        Ok(())
    }

    fn update_messages(&mut self, grid: usize, steps: Range<u32>) -> Result<(), Error> {
        if self.plan.settings().schedule == Schedule::Sweep {
            // All loops of a band run together, at the last step.
            if steps.end == self.plan.settings().steps {
                self.run_sweeps(grid);
            }
            return Ok(());
        }
        let mut messages = std::mem::replace(&mut self.messages[grid % 2], Messages::none());
        let (layout, costs) = (&self.layouts[grid], &self.costs[grid].stored);
        let coarser = self.coarser(grid);
        let keeps_messages = grid == 0 && self.keeps_messages;
        let pass = Pass { level: self.level, plan: &self.plan, layout, first: 0, costs, coarser, keeps_messages };
        half_steps::run(&pass, steps.start as usize..steps.end as usize, &mut messages.sets);
        self.messages[grid % 2] = messages;
        Ok(())
    }

    fn select_labels(&mut self, labels: &mut [u16]) -> Result<(), Error> {
        match self.plan.settings().schedule {
            Schedule::Sweep => labels.copy_from_slice(&self.decided),
            Schedule::Sync | Schedule::Checkerboard => select_labels(&self.answer(), labels),
        }
        Ok(())
    }

    fn read_messages(&mut self, side: Side, messages: &mut [u8]) -> Result<(), Error> {
        match self.plan.settings().schedule {
            Schedule::Sweep => self.sweep(0).read_messages(&self.seams, side, messages),
            Schedule::Sync | Schedule::Checkerboard => self.answer().read_messages(&self.plan, side, messages),
        }
        Ok(())
    }

    fn fused_steps(&self) -> u32 {
        match self.plan.settings().schedule {
            Schedule::Sweep => u32::MAX,
            Schedule::Sync | Schedule::Checkerboard => half_steps::steps_at_a_time(&self.layouts[0]) as u32,
        }
    }

    /// Refining is part of updating: the first step on a grid reads the coarser grid's messages instead of its own. Over all
    /// grids, this saves reading the messages of one step on the finest grid.
    fn moved_bytes(&self) -> Option<[u64; Stage::ALL.len()]> {
        let [match_cost, coarsen, _, update_messages, select_labels] = self.plan.moved_bytes()?;
        Some([match_cost, coarsen, 0, update_messages - self.plan.updates_per_step(0), select_labels])
    }

    fn allocated_bytes(&self) -> u64 {
        let costs: u64 = self.costs.iter().map(Costs::bytes).sum();
        let messages: u64 = self.messages.iter().flat_map(|messages| &messages.sets).map(Edges::bytes).sum();
        let layouts: u64 = self.layouts.iter().map(Layout::bytes).sum();
        self.features.bytes()
            + costs
            + messages
            + layouts
            + self.windows.bytes()
            + self.seams.bytes()
            + memory::bytes(&self.decided)
    }
}

impl RayonSolver {
    /// Runs all loops on a grid, and decides the labels of the finest one.
    fn run_sweeps(&mut self, grid: usize) {
        let mut seams = std::mem::replace(&mut self.seams, Seams::none());
        self.sweep(grid).prepare(&mut seams, grid == 0);
        if grid == 0 {
            let mut decided = std::mem::take(&mut self.decided);
            self.sweep(0).decode(&seams, &mut decided);
            self.decided = decided;
        } else {
            let mut messages = std::mem::replace(&mut self.messages[grid % 2], Messages::none());
            self.sweep(grid).keep_messages(&seams, &mut messages.sets[0]);
            self.messages[grid % 2] = messages;
        }
        self.seams = seams;
    }
}
