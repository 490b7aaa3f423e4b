//! Data costs of a coarser grid.

use bp_core::Size;

use crate::costs::Costs;

/// A coarse node's cost is the sum of its up to four children's costs, label by label. `fine_size` is the finer grid's;
/// `scratch` holds one node's labels.
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
