//! The buffers of one plan, and the kernels applied to them.

use std::ops::Range;

use bp_core::{Error, Model, Plan, Schedule, Seed, Side, Solver, StereoPair};
use fearless_simd::Level;

use crate::{
    coarsen::coarsen,
    costs::{self, Costs},
    edges::{self, Edges, Rows},
    features::{self, Features},
    layout::Layout,
    match_cost::match_cost,
    refine::{Coarser, refine},
    select_labels::{decode, select_labels},
    sweep::sweep,
    update_messages::{Nodes, Sends, update_messages},
    wavefront::{Chunk, Wavefront, fused_steps},
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
}

/// The messages of one grid: as many sets of one an edge as the schedule needs. A grid is bipartite, so that a
/// synchronous run is two runs of half-steps that do not touch: one where even nodes send first, one where odd ones do.
/// `checkerboard` is the first of them; its last half-step alone goes to the second set, so that what its senders
/// received is not lost. A sweep keeps one message an edge by definition.
struct Messages {
    sets: [Edges; 2],
}

/// Sets of messages that a schedule needs.
fn sets(schedule: Schedule) -> usize {
    if schedule == Schedule::Sweep { 1 } else { 2 }
}

/// Bytes that a solver will allocate.
pub(crate) fn planned_bytes(plan: &Plan) -> u64 {
    let messages = |grid| edges::bytes(&Layout::new(plan, grid)) as u64 * sets(plan.settings().schedule) as u64;
    let buffers = (0..plan.grids()).map(|grid| costs::bytes(plan, grid)).chain((0..plan.grids().min(2)).map(messages));
    let labels = 2 * plan.image_size().pixels() as u64;
    buffers.fold(features::bytes(plan.image_size(), plan.model()) + labels, u64::saturating_add)
}

impl RayonSolver {
    /// Allocates all buffers.
    pub(crate) fn new(level: Level, plan: &Plan) -> Result<Self, Error> {
        let set = |grid, set| {
            let needed = grid < plan.grids() && set < sets(plan.settings().schedule);
            if needed { Edges::new(plan, grid) } else { Ok(Edges::none()) }
        };
        let messages = |grid| Ok::<_, Error>(Messages { sets: [set(grid, 0)?, set(grid, 1)?] });
        Ok(Self {
            level,
            layouts: (0..plan.grids()).map(|grid| Layout::new(plan, grid)).collect(),
            features: Features::new(plan.image_size(), plan.model())?,
            costs: (0..plan.grids()).map(|grid| Costs::new(plan, grid)).collect::<Result<_, _>>()?,
            messages: [messages(0)?, messages(1)?],
            plan: plan.clone(),
        })
    }

    fn answer(&self) -> Answer<'_> {
        Answer {
            level: self.level,
            model: self.plan.model(),
            layout: &self.layouts[0],
            stored: &self.costs[0].stored,
            received: received(&self.plan, &self.layouts[0], &self.messages[0]),
        }
    }
}

/// What the nodes of either checkerboard colour of a grid received last.
fn received<'a>(plan: &Plan, layout: &'a Layout, messages: &'a Messages) -> [Rows<'a>; 2] {
    let steps = plan.settings().steps as usize;
    [0, 1].map(|colour| {
        let set = match plan.settings().schedule {
            Schedule::Sync => (colour + steps) % 2,
            Schedule::Checkerboard => usize::from(colour == steps % 2),
            Schedule::Sweep => 0,
        };
        messages.sets[set].rows(layout)
    })
}

/// What updating the messages of a grid needs besides those.
pub(crate) struct Grid<'a> {
    level: Level,
    plan: &'a Plan,
    pub(crate) layout: &'a Layout,
    costs: &'a [u8],
    coarser: Option<Coarser<'a>>,
}

impl Grid<'_> {
    /// Gives nodes of a plane in row `y`, with which `rows` start, their first messages.
    pub(crate) fn refine(&self, (plane, y): (usize, usize), sides: &[Side], rows: &mut [u8]) {
        let mut slots = edges::slots(self.layout, rows, plane);
        refine(self.level, self.plan, self.layout, self.coarser, (plane, y), sides, &mut slots.slots);
    }

    /// Lets nodes of a plane in row `y` send.
    pub(crate) fn send(&self, (plane, y): (usize, usize), sends: Sends, rows: &mut [u8]) {
        let mut slots = edges::slots(self.layout, rows, plane).slots;
        self.drop_missing(y, &mut slots);
        update_messages(self.level, sends, &self.nodes(plane, y), slots);
    }

    /// The same with up in place of down.
    pub(crate) fn send_up(&self, (plane, y): (usize, usize), sends: Sends, rows: &mut [u8]) {
        let mut slots = edges::slots(self.layout, rows, plane).slots;
        self.drop_missing(y, &mut slots);
        let [same, next, up, down] = slots;
        update_messages(self.level, sends, &self.nodes(plane, y), [same, next, down, up]);
    }

    fn nodes(&self, plane: usize, y: usize) -> Nodes<'_> {
        let (layout, model) = (self.layout, self.plan.model());
        Nodes {
            costs: &self.costs[y * layout.row() + plane * layout.plane()..][..layout.plane()],
            masks: layout.masks(plane),
            nodes: layout.nodes(plane),
            lanes: layout.lanes,
            step: model.step(),
            truncation: model.truncation(),
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

/// What labels are read off.
pub(crate) struct Answer<'a> {
    pub(crate) level: Level,
    pub(crate) model: &'a Model,
    pub(crate) layout: &'a Layout,
    stored: &'a [u8],
    /// What nodes of either checkerboard colour received.
    pub(crate) received: [Rows<'a>; 2],
}

impl Answer<'_> {
    pub(crate) fn costs(&self, plane: usize, y: usize) -> &[u8] {
        &self.stored[y * self.layout.row() + plane * self.layout.plane()..][..self.layout.plane()]
    }
}

/// Runs steps of either schedule of half-steps; `sends_first` is the colour of the nodes that send in step 0, and
/// `last` is the half-step that goes to the second set.
fn half_steps(grid: &Grid<'_>, steps: Range<usize>, sends_first: usize, sets: [&mut [u8]; 2], last: Option<usize>) {
    let row_bytes = edges::row_bytes(grid.layout);
    let [set, other] = sets.map(|rows| Chunk { row_bytes: if rows.is_empty() { 0 } else { row_bytes }, rows });
    let step = |[rows, other]: [&mut [u8]; 2], y: usize, t: usize| {
        let t = steps.start + t;
        let place = ((y + t + sends_first) % 2, y);
        if t == 0 {
            grid.refine(place, &Side::ALL, rows);
        }
        if last == Some(t) {
            edges::copy(grid.layout, rows, other, place.0);
            grid.send(place, Sends::All, other);
        } else {
            grid.send(place, Sends::All, rows);
        }
    };
    Wavefront { height: grid.layout.size.height, steps: steps.len() }.run([set, other], &step);
}

impl Solver for RayonSolver {
    fn match_cost(&mut self, pair: &StereoPair, seed: Option<Seed>) -> Result<(), Error> {
        self.features.load(pair);
        match_cost(self.level, &self.plan, &self.layouts[0], &self.features, seed, &mut self.costs[0]);
        Ok(())
    }

    fn coarsen(&mut self, grid: usize) -> Result<(), Error> {
        let (fine, coarse) = self.costs.split_at_mut(grid);
        let layouts = [&self.layouts[grid - 1], &self.layouts[grid]];
        coarsen(self.level, &self.plan, grid, layouts, &fine[grid - 1], &mut coarse[0]);
        Ok(())
    }

    /// Nothing yet: nodes take over first messages when they first send, see [`refine`].
    fn refine(&mut self, _grid: usize) -> Result<(), Error> {
        Ok(())
    }

    fn update_messages(&mut self, grid: usize, steps: Range<u32>) -> Result<(), Error> {
        let Self { plan, layouts, messages: [even, odd], .. } = self;
        let (own, coarser) = if grid.is_multiple_of(2) { (even, odd) } else { (odd, even) };
        let coarser = layouts.get(grid + 1).map(|layout| Coarser { layout, received: received(plan, layout, coarser) });
        let costs = &self.costs[grid].stored;
        let grid = Grid { level: self.level, plan, layout: &layouts[grid], costs, coarser };
        run(&grid, steps.start as usize..steps.end as usize, own);
        Ok(())
    }

    fn select_labels(&mut self, labels: &mut [u16]) -> Result<(), Error> {
        match self.plan.settings().schedule {
            Schedule::Sweep => decode(&self.answer(), labels),
            Schedule::Sync | Schedule::Checkerboard => select_labels(&self.answer(), labels),
        }
        Ok(())
    }

    fn read_messages(&mut self, side: Side, messages: &mut [u8]) -> Result<(), Error> {
        let (answer, layout) = (self.answer(), &self.layouts[0]);
        let one_an_edge = self.plan.settings().schedule == Schedule::Sweep;
        let nodes = (0..layout.size.height).flat_map(|y| layout.columns().map(move |column| (column, y)));
        for (((x, plane, lane), y), out) in nodes.zip(messages.chunks_exact_mut(layout.labels)) {
            let colour = (x + y) % 2;
            let went_away = one_an_edge && (side == Side::Up || side != Side::Down && colour == 1);
            let there = self.plan.neighbour(0, (x, y), side).is_some() && !went_away;
            let values = answer.received[colour].towards(side, plane, y).filter(|_| there);
            for (label, out) in out.iter_mut().enumerate() {
                *out = values.map_or(0, |values| values[label * layout.lanes + lane]);
            }
        }
        Ok(())
    }

    fn fused_steps(&self) -> u32 {
        u32::try_from(fused_steps(self.layouts[0].row() + edges::row_bytes(&self.layouts[0]))).unwrap_or(u32::MAX)
    }

    fn allocated_bytes(&self) -> u64 {
        let costs: u64 = self.costs.iter().map(Costs::bytes).sum();
        let messages: u64 = self.messages.iter().flat_map(|messages| &messages.sets).map(Edges::bytes).sum();
        self.features.bytes() + costs + messages
    }
}

/// Runs steps of the plan's schedule.
fn run(grid: &Grid<'_>, steps: Range<usize>, messages: &mut Messages) {
    let all = grid.plan.settings().steps as usize;
    let at_a_time = fused_steps(grid.layout.row() + edges::row_bytes(grid.layout));
    if grid.plan.settings().schedule == Schedule::Sweep {
        return steps.for_each(|step| sweep(grid, step == 0, messages.sets[0].rows_mut(grid.layout)));
    }
    for start in steps.clone().step_by(at_a_time) {
        let steps = start..(start + at_a_time).min(steps.end);
        let [first, second] = messages.sets.each_mut().map(|set| set.rows_mut(grid.layout));
        if grid.plan.settings().schedule == Schedule::Checkerboard {
            half_steps(grid, steps, 0, [first, second], Some(all - 1));
        } else {
            let halves = (steps.clone(), steps);
            rayon::join(
                || half_steps(grid, halves.0, 0, [first, &mut []], None),
                || half_steps(grid, halves.1, 1, [second, &mut []], None),
            );
        }
    }
}
