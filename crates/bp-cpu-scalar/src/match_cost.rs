//! Data costs of the image.

use bp_core::{DataCost, Plan};

use crate::costs::Costs;

/// Computes the costs of grid 0. `scratch` has room for one node's labels.
pub(crate) fn match_cost(data_cost: &DataCost, plan: &Plan, costs: &mut Costs, scratch: &mut [u64]) {
    let size = plan.image_size();
    for node in 0..size.pixels() {
        let (x, y) = (node % size.width, node / size.width);
        for (label, cost) in scratch.iter_mut().enumerate() {
            *cost = data_cost.at(plan.margin() + x, y, label as u16).into();
        }
        costs.store(node, scratch);
    }
}
