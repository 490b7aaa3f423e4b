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

use super::edges::Rows;
use crate::{
    layout::Layout,
    shape::{BLOCK, PlaneRow},
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
    slots: &mut [&mut [u8]; 4],
) {
    for side in Side::ALL {
        let slot = &mut *slots[slot(side, at.plane)];
        match coarser.and_then(|coarser| source(plan, coarser, at, side)) {
            Some(source) => dispatch!(level, simd => source.expand(simd, layout, at.plane, slot)),
            None => slot[..layout.plane()].fill(0),
        }
    }
}

/// The slot in which a node of `plane` keeps its edge to `side`.
pub(crate) fn slot(side: Side, plane: usize) -> usize {
    match (side, plane) {
        (Side::Right, 0) | (Side::Left, 1) => 0,
        (Side::Left | Side::Right, _) => 1,
        (Side::Up, _) => 2,
        (Side::Down, _) => 3,
    }
}

/// The source of the first messages of fine nodes: lane i takes them from lane i div 2 of `planes[i % 2]`.
#[derive(Clone, Copy)]
struct Source<'a> {
    lanes: usize,
    planes: [Parents<'a>; 2],
}

/// The nodes of a coarse row and plane that messages are taken from.
#[derive(Clone, Copy)]
struct Parents<'a> {
    /// Their messages, `[label][lane]`.
    values: &'a [u8],
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
        let received = &coarser.received[(plane + y) % 2];
        let mask = matches!(side, Side::Left | Side::Right).then(|| layout.padded_masks(plane)[slot(side, plane)]);
        let mask = mask.map(|mask| &mask[BLOCK.wrapping_add_signed(moved)..]);
        Some(Parents { values: received.towards_moved(side, plane, y, moved)?, mask })
    });
    Some(Source { lanes: layout.lanes, planes: [even?, odd?] })
}

/// For the even and the odd lanes of a fine plane, whose lane i has coarse column i as its parent: the coarse plane
/// that messages are taken from, and the offset in lanes.
fn columns(side: Side, plane: usize, by_sender: bool) -> [(usize, isize); 2] {
    match (side, plane) {
        // A sender's parent that is also the receiver's parent sends to the adjacent coarse column.
        (Side::Left, 1) if by_sender => [(1, 0), (0, 1)],
        (Side::Right, 0) if by_sender => [(1, -1), (0, 0)],
        _ => [(0, 0), (1, 0)],
    }
}

impl Source<'_> {
    /// Writes the first messages of the nodes of `plane`.
    #[inline(always)]
    fn expand<S: Simd>(&self, simd: S, layout: &Layout, plane: usize, slot: &mut [u8]) {
        interleave(
            simd,
            layout,
            plane,
            slot,
            #[inline(always)]
            |label, lane| self.load(simd, label * self.lanes + lane, lane),
        );
    }

    /// The messages of two vectors of parents, those in even and those in odd columns.
    #[inline(always)]
    fn load<S: Simd>(&self, simd: S, from: usize, lane: usize) -> [S::u8s; 2] {
        let [even, odd] = &self.planes;
        [even.load(simd, from, lane), odd.load(simd, from, lane)]
    }
}

/// Writes to the nodes of a plane what `parents` returns for a label and a lane of their parents.
#[inline(always)]
fn interleave<S: Simd>(
    simd: S,
    layout: &Layout,
    plane: usize,
    slot: &mut [u8],
    parents: impl Fn(usize, usize) -> [S::u8s; 2],
) {
    simd.vectorize(
        #[inline(always)]
        || {
            for (label, to) in slot[..layout.plane()].chunks_exact_mut(layout.lanes).enumerate() {
                for at in (0..layout.nodes(plane)).step_by(2 * S::u8s::LEN) {
                    let [even, odd] = parents(label, at / 2);
                    let (low, high) = even.interleave(odd);
                    low.store_slice(&mut to[at..at + S::u8s::LEN]);
                    if at + S::u8s::LEN < layout.lanes {
                        high.store_slice(&mut to[at + S::u8s::LEN..at + 2 * S::u8s::LEN]);
                    }
                }
            }
        },
    );
}

impl Parents<'_> {
    /// The messages of a vector of lanes that starts at `from`; zeros where a lane has no sender.
    #[inline(always)]
    fn load<S: Simd>(&self, simd: S, from: usize, lane: usize) -> S::u8s {
        let values = S::u8s::from_slice(simd, &self.values[from..from + S::u8s::LEN]);
        match self.mask {
            Some(mask) => values & S::u8s::from_slice(simd, &mask[lane..lane + S::u8s::LEN]),
            None => values,
        }
    }
}
