//! Data costs of a coarser grid.

use bp_core::Size;

use crate::costs::Costs;

/// Computes the costs of a coarser grid: a node sums the costs of its children, at most four, label by label.
/// `fine_size` is the size of the finer grid. `scratch` has room for one node's labels.
pub(crate) fn coarsen(fine: &Costs, fine_size: Size, coarse: &mut Costs, scratch: &mut [u64]) {
    let size = fine_size.coarser();
    for node in 0..size.pixels() {
        let (x, y) = (2 * (node % size.width), 2 * (node / size.width));
        scratch.fill(0);
        for child_y in y..(y + 2).min(fine_size.height) {
            for child_x in x..(x + 2).min(fine_size.width) {
                fine.add_unclipped(child_y * fine_size.width + child_x, scratch);
            }
        }
        coarse.store(node, scratch);
    }
}
