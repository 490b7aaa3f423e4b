//! The schedules `sync` and `checkerboard`: half-steps in which the nodes of one colour send.

use std::ops::Range;

use bp_core::{Schedule, Side};

use crate::{
    edges::{self, Edges},
    layout::Layout,
    pass::{Pass, Way},
    update_messages::Sends,
    wavefront::{Part, Wavefront, fused_steps},
};

/// How many steps are run at a time on a grid.
pub(crate) fn steps_at_a_time(layout: &Layout) -> usize {
    fused_steps(layout.row() + edges::row_bytes(layout))
}

/// Runs steps of the plan's schedule.
pub(crate) fn run(grid: &Pass<'_>, steps: Range<usize>, sets: &mut [Edges; 2]) {
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

/// Runs steps of either schedule of half-steps; `sends_first` is the colour of the nodes that send in step 0, and
/// `last` is the half-step that goes to the second set.
fn half_steps(grid: &Pass<'_>, steps: Range<usize>, sends_first: usize, sets: [&mut [u8]; 2], last: Option<usize>) {
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
