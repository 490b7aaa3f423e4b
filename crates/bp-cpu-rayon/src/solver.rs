//! The buffers of one plan, and the kernels applied to them.

use std::ops::Range;

use bp_core::{Error, Plan, Schedule, Seed, Side, Solver, Stage, StereoPair, memory};
use fearless_simd::Level;

use crate::{
    coarsen::{coarsen, coarsen_unstored},
    costs::{self, Costs},
    edges::{self, Edges, Rows},
    features::{self, Features},
    greys::Around,
    layout::{self, Layout, Shape},
    match_cost::{Matching, is_narrow, match_cost},
    refine::{Coarser, refine},
    select_labels::{Answer, select_labels},
    sweep::{self, Bands, CostSource, Windows},
    update_messages::{Nodes, Sends, update_messages},
    wavefront::{Part, Wavefront, fused_steps},
};

/// A prepared plan.
pub(crate) struct RayonSolver {
    level: Level,
    plan: Plan,
    layouts: Vec<Layout>,
    features: Features,
    costs: Vec<Costs>,
    /// Messages of even grids and, where the plan has several grids, of odd ones: only a grid and its next coarser one
    /// are needed at a time.
    messages: [Messages; 2],
    windows: Windows,
    /// Whether grid 0 starts with the messages that it holds.
    keeps_messages: bool,
    seed: Option<Seed>,
    /// Labels of a swept image, decided while its messages are in cache.
    decided: Vec<u16>,
}

/// The messages of one grid: as many sets of one an edge as the schedule needs. A grid is bipartite, so that a
/// synchronous run is two runs of half-steps that do not touch: one where even nodes send first, one where odd ones do.
/// `checkerboard` is the first of them; its last half-step alone goes to the second set, so that what its senders
/// received is not lost. A sweep keeps one message an edge by definition.
struct Messages {
    sets: [Edges; 2],
}

impl Messages {
    fn none() -> Self {
        Self { sets: [Edges::none(), Edges::none()] }
    }
}

/// Sets of messages that are kept of a grid: of a swept image none.
fn sets(plan: &Plan, grid: usize) -> usize {
    match plan.settings().schedule {
        Schedule::Sweep => usize::from(grid > 0),
        Schedule::Sync | Schedule::Checkerboard => 2,
    }
}

/// The two grids whose messages need the most room: the finest of even and of odd index that keep any.
fn largest(plan: &Plan) -> [usize; 2] {
    if sets(plan, 0) == 0 { [2, 1] } else { [0, 1] }
}

/// Whether the costs of a grid are stored. Those of a swept image are computed as often as needed.
pub(crate) fn is_stored(plan: &Plan, grid: usize) -> bool {
    grid > 0 || plan.settings().schedule != Schedule::Sweep || !is_narrow(plan)
}

/// Bytes that a solver will allocate.
pub(crate) fn planned_bytes(plan: &Plan) -> u64 {
    let stored = (0..plan.grids()).filter(|&grid| is_stored(plan, grid));
    let costs = stored.map(|grid| costs::bytes(plan, grid));
    let kept = largest(plan).into_iter().filter(|&grid| grid < plan.grids());
    let messages = kept.map(|grid| edges::bytes(&Shape::new(plan, grid)) as u64 * sets(plan, grid) as u64);
    let labels = 2 * plan.image_size().pixels() as u64;
    let decided = if plan.settings().schedule == Schedule::Sweep { labels } else { 0 };
    let layouts = (0..plan.grids()).map(|grid| layout::bytes(plan, grid));
    let others = [labels, decided, features::bytes(plan.image_size(), plan.model()), sweep::bytes(plan)];
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

    /// The bands of a grid that is swept.
    fn bands(&self, grid: usize) -> Bands<'_> {
        let Self { level, plan, layouts, windows, .. } = self;
        let costs = if is_stored(plan, grid) {
            CostSource::Stored(&self.costs[grid].stored)
        } else {
            CostSource::Computed(self.matching())
        };
        let coarser = self.coarser(grid);
        Bands { level: *level, plan, layout: &layouts[grid], costs, coarser, windows }
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

/// What the nodes of either checkerboard colour of a grid received last.
fn received<'a>(plan: &Plan, layout: &'a Layout, messages: &'a Messages) -> [Rows<'a>; 2] {
    received_in(plan).map(|set| messages.sets[set].rows(layout))
}

/// The set of messages that holds it.
fn received_in(plan: &Plan) -> [usize; 2] {
    let steps = plan.settings().steps as usize;
    [0, 1].map(|colour| match plan.settings().schedule {
        Schedule::Sync => (colour + steps) % 2,
        Schedule::Checkerboard => usize::from(colour == steps % 2),
        Schedule::Sweep => 0,
    })
}

/// Which way a pass over the rows goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Way {
    Down,
    Up,
}

/// What updating the messages of a grid needs besides those.
pub(crate) struct Grid<'a> {
    pub(crate) level: Level,
    pub(crate) plan: &'a Plan,
    pub(crate) layout: &'a Layout,
    /// Row that `costs` start with.
    pub(crate) first: usize,
    pub(crate) costs: &'a [u8],
    pub(crate) coarser: Option<Coarser<'a>>,
    /// Whether it starts with the messages that it holds in place of the coarser grid's.
    pub(crate) keeps_messages: bool,
}

impl Grid<'_> {
    /// Gives nodes of a plane in row `y`, with which `rows` start, their first messages.
    pub(crate) fn refine(&self, (plane, y): (usize, usize), sides: &[Side], rows: &mut [u8]) {
        let mut slots = edges::slots(self.layout, rows, plane);
        refine(self.level, self.plan, self.layout, self.coarser, (plane, y), sides, &mut slots);
    }

    /// Lets nodes of a plane in row `y`, with which `rows` start, send in a pass that goes some way.
    pub(crate) fn send(&self, way: Way, (plane, y): (usize, usize), sends: Sends, rows: &mut [u8]) {
        let mut slots = edges::slots(self.layout, rows, plane);
        self.drop_missing(y, &mut slots);
        let mut nodes = self.nodes(plane, y);
        if way == Way::Up {
            slots.swap(2, 3);
            nodes.around = nodes.around.map(Around::upwards);
        }
        update_messages(self.level, sends, &nodes, slots);
    }

    fn nodes(&self, plane: usize, y: usize) -> Nodes<'_> {
        let (layout, model) = (self.layout, self.plan.model());
        Nodes {
            costs: &self.costs[(y - self.first) * layout.row() + plane * layout.plane()..][..layout.plane()],
            masks: layout.masks(plane),
            nodes: layout.nodes(plane),
            lanes: layout.lanes,
            smoothness: model.smoothness(),
            around: layout.around(plane, y),
        }
    }

    /// Zeros in the slots of neighbours above and below that are not there. Of those at the sides, masks take care.
    fn drop_missing(&self, y: usize, [_, _, up, down]: &mut [&mut [u8]; 4]) {
        for (row, slot) in [(y, up), (y + 1, down)] {
            if !self.layout.joined_above(row) {
                slot.fill(0);
            }
        }
    }
}

/// Runs steps of either schedule of half-steps; `sends_first` is the colour of the nodes that send in step 0, and
/// `last` is the half-step that goes to the second set.
fn half_steps(grid: &Grid<'_>, steps: Range<usize>, sends_first: usize, sets: [&mut [u8]; 2], last: Option<usize>) {
    let row_bytes = edges::row_bytes(grid.layout);
    let [set, other] = sets.map(|rows| Part { row_bytes: if rows.is_empty() { 0 } else { row_bytes }, rows });
    let step = |[rows, other]: [&mut [u8]; 2], y: usize, t: usize| {
        let t = steps.start + t;
        let place = ((y + t + sends_first) % 2, y);
        if t == 0 && !grid.keeps_messages {
            grid.refine(place, &Side::ALL, rows);
        }
        if last == Some(t) {
            edges::copy(grid.layout, rows, other, place.0);
            grid.send(Way::Down, place, Sends::All, other);
        } else {
            grid.send(Way::Down, place, Sends::All, rows);
        }
    };
    Wavefront { height: grid.layout.size.height, steps: steps.len() }.run([set, other], &step);
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

    /// Nothing yet: nodes take over first messages when they first send, see [`crate::refine`].
    fn refine(&mut self, _grid: usize) -> Result<(), Error> {
        self.keeps_messages = false;
        Ok(())
    }

    /// Even nodes send first, in the first set: that is to be the one with what they received last.
    fn keep_messages(&mut self) -> Result<(), Error> {
        let [of_even, _] = received_in(&self.plan);
        self.messages[0].sets.rotate_left(of_even);
        self.keeps_messages = true;
        Ok(())
    }

    fn update_messages(&mut self, grid: usize, steps: Range<u32>) -> Result<(), Error> {
        if self.plan.settings().schedule == Schedule::Sweep {
            // All loops of a band are one piece of work.
            if steps.end == self.plan.settings().steps {
                self.sweep(grid);
            }
            return Ok(());
        }
        let mut messages = std::mem::replace(&mut self.messages[grid % 2], Messages::none());
        let (layout, costs) = (&self.layouts[grid], &self.costs[grid].stored);
        let coarser = self.coarser(grid);
        let keeps_messages = grid == 0 && self.keeps_messages;
        let grid_of = Grid { level: self.level, plan: &self.plan, layout, first: 0, costs, coarser, keeps_messages };
        run(&grid_of, steps.start as usize..steps.end as usize, &mut messages);
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
            Schedule::Sweep => self.bands(0).read_messages(side, messages),
            Schedule::Sync | Schedule::Checkerboard => self.answer().read_messages(&self.plan, side, messages),
        }
        Ok(())
    }

    fn fused_steps(&self) -> u32 {
        match self.plan.settings().schedule {
            Schedule::Sweep => u32::MAX,
            Schedule::Sync | Schedule::Checkerboard => steps_at_a_time(&self.layouts[0]) as u32,
        }
    }

    /// Refining is part of updating: the first step on a grid reads the coarser grid's messages in place of its own, which
    /// over all grids leaves out one step's messages of the finest.
    fn moved_bytes(&self) -> Option<[u64; Stage::ALL.len()]> {
        let [match_cost, coarsen, _, update_messages, select_labels] = self.plan.moved_bytes()?;
        Some([match_cost, coarsen, 0, update_messages - self.plan.updates_per_step(0), select_labels])
    }

    fn allocated_bytes(&self) -> u64 {
        let costs: u64 = self.costs.iter().map(Costs::bytes).sum();
        let messages: u64 = self.messages.iter().flat_map(|messages| &messages.sets).map(Edges::bytes).sum();
        let layouts: u64 = self.layouts.iter().map(Layout::bytes).sum();
        self.features.bytes() + costs + messages + layouts + self.windows.bytes() + memory::bytes(&self.decided)
    }
}

impl RayonSolver {
    fn sweep(&mut self, grid: usize) {
        if grid == 0 {
            let mut decided = std::mem::take(&mut self.decided);
            self.bands(0).decode(&mut decided);
            self.decided = decided;
        } else {
            let mut messages = std::mem::replace(&mut self.messages[grid % 2], Messages::none());
            self.bands(grid).keep_messages(&mut messages.sets[0]);
            self.messages[grid % 2] = messages;
        }
    }
}

fn steps_at_a_time(layout: &Layout) -> usize {
    fused_steps(layout.row() + edges::row_bytes(layout))
}

/// Runs steps of the plan's schedule.
fn run(grid: &Grid<'_>, steps: Range<usize>, messages: &mut Messages) {
    let last = grid.plan.settings().steps as usize - 1;
    let at_a_time = steps_at_a_time(grid.layout);
    for start in steps.clone().step_by(at_a_time) {
        let steps = start..(start + at_a_time).min(steps.end);
        let [first, second] = messages.sets.each_mut().map(|set| set.rows_mut(grid.layout));
        if grid.plan.settings().schedule == Schedule::Checkerboard {
            half_steps(grid, steps, 0, [first, second], Some(last));
        } else {
            let halves = (steps.clone(), steps);
            rayon::join(
                || half_steps(grid, halves.0, 0, [first, &mut []], None),
                || half_steps(grid, halves.1, 1, [second, &mut []], None),
            );
        }
    }
}
