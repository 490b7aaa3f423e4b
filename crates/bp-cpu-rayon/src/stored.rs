//! Which data costs are stored, and which are computed when they are needed.

use bp_core::{Plan, Schedule};

/// Whether the costs of a grid are stored. Under `sweep`, those of grid 0 are computed when needed if they fit 8 bits, and so
/// are those of grid 1 if it has label sets and the sums of grid 2 fit too, and those of grid 2 if it has label sets, its own sums fit 8
/// bits and those of grid 3 fit 16.
pub(crate) fn is_stored(plan: &Plan, grid: usize) -> bool {
    match grid {
        0 => plan.settings().schedule != Schedule::Sweep || !is_narrow(plan),
        1 => !plan.has_label_sets(1) || plan.sum_bytes(2) > 1,
        2 => !plan.has_label_sets(2) || plan.sum_bytes(2) > 1 || plan.sum_bytes(3) != 2,
        _ => true,
    }
}

/// Whether the costs of a grid are stored while the next coarser one is made, in one pass: those of grid 2 if those of grid 1 are not
/// stored and the sums of grid 3 fit 16 bits.
pub(crate) fn is_made_with_next(plan: &Plan, grid: usize) -> bool {
    grid == 2 && plan.grids() > 3 && !is_stored(plan, 1) && is_stored(plan, 2) && plan.sum_bytes(3) == 2
}

/// Whether a grid keeps its sums. Once the next coarser grid is made, nobody needs them.
pub(crate) fn keeps_sums(plan: &Plan, grid: usize) -> bool {
    plan.keeps_sums(grid) && !is_made_with_next(plan, grid)
}

/// Whether all costs of grid 0 fit 8 bits.
pub(crate) fn is_narrow(plan: &Plan) -> bool {
    plan.sum_bytes(0) == 1
}
