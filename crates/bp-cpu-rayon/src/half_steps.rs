//! The schedules `sync` and `checkerboard`, whose half-steps have all nodes of one colour send, and `outward`, which stores its
//! messages in the same way.

mod edges;
mod labels;
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

pub(crate) use edges::{Edges, Rows, bytes, read_messages};
pub(crate) use labels::{Labels, bytes as labels_bytes};
pub(crate) use pass::{Last, Pass};
pub(crate) use refine::Coarser;

/// The number of steps that run together on a grid.
pub(crate) fn steps_at_a_time(layout: &Layout) -> usize {
    fused_steps(layout.row() + edges::row(layout))
}

/// Runs steps of the plan's schedule on the two sets of messages of a grid. Under [`Last::Decides`] and [`Last::DecidesOnly`] the
/// last step also decides the labels of grid 0.
pub(crate) fn run(grid: &Pass<'_>, steps: Range<usize>, sets: &mut [Edges; 2], labels: &mut Labels) {
    let all = grid.plan.settings().steps as usize;
    let decides = grid.last != Last::Keeps && steps.end == all;
    let mut labels = labels.rows_mut().map(|rows| if decides { rows } else { &mut [] });
    if let Schedule::Outward { start } = grid.plan.settings().schedule {
        return outward::run(grid, start, steps, sets.each_mut().map(|set| set.rows_mut(grid.layout)), labels);
    }
    let at_a_time = steps_at_a_time(grid.layout);
    for start in steps.clone().step_by(at_a_time) {
        let steps = start..(start + at_a_time).min(steps.end);
        let [first, second] = sets.each_mut().map(|set| set.rows_mut(grid.layout));
        let labels = labels.each_mut().map(|rows| if steps.end == all { &mut **rows } else { &mut [] });
        if grid.plan.settings().schedule == Schedule::Checkerboard {
            let second = if grid.last == Last::DecidesOnly { &mut [] } else { second };
            half_steps(grid, steps, 0, [first, second], labels);
        } else {
            // The nodes that receive last in one run are those that send last in the other.
            let [even, odd] = labels;
            let (of_first, of_second) = if all.is_multiple_of(2) {
                ([even, &mut []], [&mut [], odd])
            } else {
                ([&mut [], odd], [even, &mut []])
            };
            let halves = (steps.clone(), steps);
            rayon::join(
                || half_steps(grid, halves.0, 0, [first, &mut []], of_first),
                || half_steps(grid, halves.1, 1, [second, &mut []], of_second),
            );
        }
    }
}

/// Runs half-steps. In step 0 the nodes of colour `sends_first` send. The last half-step writes to the second set, if there is one.
/// `labels` are those to be decided, by colour: of the nodes that send in the last half-step before it, of the others after it, which
/// is one more step.
fn half_steps(
    grid: &Pass<'_>,
    steps: Range<usize>,
    sends_first: usize,
    sets: [&mut [Block]; 2],
    labels: [&mut [Block]; 2],
) {
    let all = grid.plan.settings().steps as usize;
    let decides = labels.iter().any(|rows| !rows.is_empty());
    let [set, other] = sets.map(|rows| Part::new(rows, edges::row(grid.layout)));
    let [even, odd] = labels.map(|rows| Part::new(rows, labels::row(grid.layout)));
    let step = |[rows, other, even, odd]: [&mut [Block]; 4], y: usize, t: usize| {
        let t = steps.start + t;
        let at = PlaneRow { plane: (y + t + sends_first) % 2, y };
        let labels = [even, odd].into_iter().nth(at.colour()).unwrap_or_default();
        if t == all {
            return grid.decide(at, if other.is_empty() { rows } else { other }, labels);
        }
        if t == 0 && !grid.keeps_messages {
            grid.refine(at, rows);
        }
        if t + 1 == all {
            grid.decide(at, rows, labels);
        }
        if t + 1 == all && !other.is_empty() {
            edges::copy(grid.layout, rows, other, at.plane);
            grid.send(at, other);
        } else {
            grid.send(at, rows);
        }
    };
    let steps = steps.len() + usize::from(decides);
    Wavefront { height: grid.layout.size.height, steps }.run([set, other, even, odd], &step);
}
