//! First messages of a grid.
//!
//! In the terms of `bp-cpu-scalar`, the kernel computes:
//!
//! ```text
//! for each node (x, y) and each side on which it has a neighbour:
//!     message(x, y) from side = message(parent of (x, y)) from side, on the next coarser grid
//! ```
//!
//! Two fine columns share a parent, so a vector of parents is interleaved with the parents of the next plane.

use bp_core::{MessageStart, Plan, Side};
use fearless_simd::{Level, Simd, SimdBase, dispatch};

use super::edges::{Received, Rows, slot};
use crate::{
    block::{Block, Bytes, LANES},
    layout::Layout,
    shape::{PlaneRow, WIDEST},
};

/// The last messages of the next coarser grid.
#[derive(Clone, Copy)]
pub(crate) struct Coarser<'a> {
    /// Its layout.
    pub(crate) layout: &'a Layout,
    /// The messages that its nodes received, by checkerboard colour.
    pub(crate) received: [Rows<'a>; 2],
}

/// Writes the first messages of the nodes of a plane in a row: zeros if there is no coarser grid. Callers
/// do this just before these nodes send for the first time, while their row is in cache.
pub(crate) fn refine(
    level: Level,
    plan: &Plan,
    layout: &Layout,
    coarser: Option<Coarser<'_>>,
    at: PlaneRow,
    slots: &mut [&mut [Block]; 4],
) {
    for side in Side::ALL {
        let slot = &mut *slots[slot(side, at.plane)];
        match coarser.and_then(|coarser| source(plan, coarser, at, side)) {
            Some(source) => dispatch!(level, simd => source.expand(simd, layout, slot)),
            None => slot.fill(Block::ZERO),
        }
    }
}

/// The source of the first messages in a slot: lane i takes them from lane i div 2 of `planes[i % 2]`.
#[derive(Clone, Copy)]
struct Source<'a> {
    planes: [Parents<'a>; 2],
}

/// The nodes of a coarse row and plane that messages are taken from.
#[derive(Clone, Copy)]
struct Parents<'a> {
    received: Received<'a>,
    /// 255 where a lane has a neighbour that sends, otherwise 0. `None` if all have one.
    mask: Option<&'a [u8]>,
}

/// The source of the first messages from `side` for the nodes of a plane in a row. `None` if that coarse row does not
/// exist or has no neighbours on that side.
fn source<'a>(plan: &Plan, coarser: Coarser<'a>, at: PlaneRow, side: Side) -> Option<Source<'a>> {
    let PlaneRow { plane, y } = at;
    let layout = coarser.layout;
    let by_sender = plan.settings().message_start == MessageStart::Sender;
    // If sender and receiver share a parent, this parent sends to the adjacent coarse row.
    let rows = match side {
        Side::Up if by_sender => y as isize % 2,
        Side::Down if by_sender => y as isize % 2 - 1,
        _ => 0,
    };
    let y = (y / 2).checked_add_signed(rows).filter(|&y| y < layout.size.height)?;
    let [even, odd] = columns(side, plane, by_sender).map(|(plane, moved)| {
        let received = coarser.received[(plane + y) % 2].towards(side, plane, y)?.moved(moved);
        let mask = matches!(side, Side::Left | Side::Right).then(|| layout.padded_masks(plane)[slot(side, plane)]);
        Some(Parents { received, mask: mask.map(|mask| &mask[WIDEST.wrapping_add_signed(moved)..]) })
    });
    Some(Source { planes: [even?, odd?] })
}

/// For the even and the odd lanes of the slot of a fine plane, whose lane i has coarse column i as its parent: the coarse
/// plane that messages are taken from, and the offset in lanes.
fn columns(side: Side, plane: usize, by_sender: bool) -> [(usize, isize); 2] {
    match (side, plane) {
        // A sender's parent that is also the receiver's parent sends to the adjacent coarse column.
        (Side::Left, 1) if by_sender => [(1, 0), (0, 1)],
        (Side::Right, 0) if by_sender => [(1, -1), (0, 0)],
        // The values of this slot are moved; see [`super::edges`].
        (Side::Right, 1) => [(1, -1), (0, 0)],
        _ => [(0, 0), (1, 0)],
    }
}

impl Source<'_> {
    /// Writes the first messages of a slot.
    #[inline(always)]
    fn expand<S: Simd>(&self, simd: S, layout: &Layout, slot: &mut [Block]) {
        for (block, to) in slot.chunks_mut(2 * layout.labels).enumerate() {
            let (first, second) = to.split_at_mut(layout.labels);
            self.expand_block(simd, block, first, second);
        }
    }

    /// Writes the first messages of the two blocks of nodes that have the nodes of a coarse block as parents. The second block
    /// may be missing.
    #[inline(always)]
    fn expand_block<S: Simd>(&self, simd: S, block: usize, first: &mut [Block], second: &mut [Block]) {
        let parents = self.planes.map(|parents| parents.received.block(block));
        let all = Bytes::<S>::splat(simd, u8::MAX);
        let masks = self.planes.map(|parents| {
            parents.mask.map_or(all, |mask| Bytes::from_slice(simd, &mask[LANES * block..LANES * (block + 1)]))
        });
        for (label, first) in first.iter_mut().enumerate() {
            let even = parents[0].load(simd, label) & masks[0];
            let odd = parents[1].load(simd, label) & masks[1];
            let (low, high) = even.interleave(odd);
            first.store(low);
            if let Some(second) = second.get_mut(label) {
                second.store(high);
            }
        }
    }
}
