//! The schedules `sync` and `checkerboard`, whose half-steps have all nodes of one colour send, and `outward`, which stores its
//! messages in the same way.

mod edges;
mod outward;
mod pass;
mod refine;
mod select_labels;
mod update_messages;
mod wavefront;

use std::ops::Range;

use bp_core::Schedule;

use crate::{block::Block, layout::Layout, shape::PlaneRow};
use wavefront::{Part, Wavefront, fused_steps};

pub(crate) use edges::{Edges, Rows, bytes};
pub(crate) use pass::Pass;
pub(crate) use refine::Coarser;
pub(crate) use select_labels::{Answer, select_labels};

/// The number of steps that run together on a grid.
pub(crate) fn steps_at_a_time(layout: &Layout) -> usize {
    fused_steps(layout.row() + edges::row(layout))
}

/// Runs steps of the plan's schedule on the two sets of messages of a grid.
pub(crate) fn run(grid: &Pass<'_>, steps: Range<usize>, sets: &mut [Edges; 2]) {
    if let Schedule::Outward { start } = grid.plan.settings().schedule {
        return outward::run(grid, start, steps, sets.each_mut().map(|set| set.rows_mut(grid.layout)));
    }
    let last = grid.plan.settings().steps as usize - 1;
    let at_a_time = steps_at_a_time(grid.layout);
    for start in steps.clone().step_by(at_a_time) {
        let steps = start..(start + at_a_time).min(steps.end);
        let [first, second] = sets.each_mut().map(|set| set.rows_mut(grid.layout));
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

/// Runs half-steps. In step 0 the nodes of colour `sends_first` send. The half-step `last` writes to the second set.
fn half_steps(grid: &Pass<'_>, steps: Range<usize>, sends_first: usize, sets: [&mut [Block]; 2], last: Option<usize>) {
    let row = edges::row(grid.layout);
    let [set, other] = sets.map(|rows| Part { row: if rows.is_empty() { 0 } else { row }, rows });
    let step = |[rows, other]: [&mut [Block]; 2], y: usize, t: usize| {
        let t = steps.start + t;
        let at = PlaneRow { plane: (y + t + sends_first) % 2, y };
        if t == 0 && !grid.keeps_messages {
            grid.refine(at, rows);
        }
        if last == Some(t) {
            edges::copy(grid.layout, rows, other, at.plane);
            grid.send(at, other);
        } else {
            grid.send(at, rows);
        }
    };
    Wavefront { height: grid.layout.size.height, steps: steps.len() }.run([set, other], &step);
}
