//! Data costs before clipping, in the narrowest integer that holds them.

use bp_core::{Error, IsStopped, Plan, memory};

/// Costs `[node][label]` of one grid.
pub(crate) enum Sums {
    U8(Vec<u8>),
    U16(Vec<u16>),
    U32(Vec<u32>),
    U64(Vec<u64>),
}

impl Sums {
    /// Allocates room for the costs of `grid`.
    pub(crate) fn new(plan: &Plan, grid: usize, is_stopped: IsStopped<'_>) -> Result<Self, Error> {
        let (what, len) = ("data cost sums", plan.volume(grid));
        Ok(match plan.sum_bytes(grid) {
            1 => Self::U8(memory::filled_unless(is_stopped, what, len, 0)?),
            2 => Self::U16(memory::filled_unless(is_stopped, what, len, 0)?),
            4 => Self::U32(memory::filled_unless(is_stopped, what, len, 0)?),
            _ => Self::U64(memory::filled_unless(is_stopped, what, len, 0)?),
        })
    }

    /// Stores the costs of all labels of one node; the plan promises that they fit.
    pub(crate) fn store(&mut self, node: usize, costs: &[u64]) {
        let range = node * costs.len()..(node + 1) * costs.len();
        match self {
            Self::U8(sums) => sums[range].iter_mut().zip(costs).for_each(|(sum, &cost)| *sum = cost as u8),
            Self::U16(sums) => sums[range].iter_mut().zip(costs).for_each(|(sum, &cost)| *sum = cost as u16),
            Self::U32(sums) => sums[range].iter_mut().zip(costs).for_each(|(sum, &cost)| *sum = cost as u32),
            Self::U64(sums) => sums[range].copy_from_slice(costs),
        }
    }

    /// Adds the costs of all labels of one node to `costs`.
    pub(crate) fn add_to(&self, node: usize, costs: &mut [u64]) {
        let range = node * costs.len()..(node + 1) * costs.len();
        match self {
            Self::U8(sums) => add(&sums[range], costs),
            Self::U16(sums) => add(&sums[range], costs),
            Self::U32(sums) => add(&sums[range], costs),
            Self::U64(sums) => add(&sums[range], costs),
        }
    }

    /// The bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        match self {
            Self::U8(sums) => memory::bytes(sums),
            Self::U16(sums) => memory::bytes(sums),
            Self::U32(sums) => memory::bytes(sums),
            Self::U64(sums) => memory::bytes(sums),
        }
    }
}

/// Adds `sums` to `costs`, label by label.
pub(crate) fn add<T: Copy + Into<u64>>(sums: &[T], costs: &mut [u64]) {
    for (cost, &sum) in costs.iter_mut().zip(sums) {
        *cost += sum.into();
    }
}
