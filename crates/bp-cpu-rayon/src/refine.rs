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

use bp_core::{MessageStart, Plan, Schedule, Side};
use fearless_simd::{Level, Simd, SimdBase, dispatch};

use crate::{
    edges::Rows,
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

/// Writes the first messages from `sides` to the nodes of a plane in a row: zeros if there is no coarser grid. Callers
/// do this just before these nodes send for the first time, while their row is in cache.
pub(crate) fn refine(
    level: Level,
    plan: &Plan,
    layout: &Layout,
    coarser: Option<Coarser<'_>>,
    at: PlaneRow,
    sides: &[Side],
    slots: &mut [&mut [u8]; 4],
) {
    for &side in sides {
        let slot = &mut *slots[slot(side, at.plane)];
        match coarser.and_then(|coarser| source(plan, coarser, at, side)) {
            Some(source) => dispatch!(level, simd => expand(simd, layout, &source, at.plane, slot)),
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
struct Source<'a> {
    lanes: usize,
    planes: [Parents<'a>; 2],
}

/// The nodes of a coarse row and plane that messages are taken from.
struct Parents<'a> {
    /// Their messages, `[label][lane]`.
    values: &'a [u8],
    /// 255 where a lane has a neighbour that sends, otherwise 0, starting one block before the first lane.
    mask: Option<&'a [u8]>,
    /// The offset in lanes at which messages are taken.
    moved: isize,
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
    let columns =
        if plan.settings().schedule == Schedule::Sweep { swept(side, y)? } else { columns(side, plane, by_sender) };
    let received = |(plane, moved): (usize, isize)| {
        let mask = matches!(side, Side::Left | Side::Right).then(|| layout.padded_masks(plane)[slot(side, plane)]);
        Some(Parents { values: coarser.received[(plane + y) % 2].towards(side, plane, y)?, mask, moved })
    };
    let [even, odd] = columns.map(received);
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

/// As [`columns`], for a swept grid. Only its even nodes hold messages from the left and right, so an odd parent is
/// replaced by its neighbour on that side. Nothing comes from above.
fn swept(side: Side, y: usize) -> Option<[(usize, isize); 2]> {
    match (side, y % 2) {
        (Side::Up, _) => None,
        (Side::Down, _) => Some([(0, 0), (1, 0)]),
        (Side::Left, 0) => Some([(0, 0), (0, 0)]),
        (Side::Left, _) => Some([(1, -1), (1, 0)]),
        (Side::Right, 0) => Some([(0, 0), (0, 1)]),
        (Side::Right, _) => Some([(1, 0), (1, 0)]),
    }
}

/// Writes the first messages of the nodes of `plane`.
#[inline(always)]
fn expand<S: Simd>(simd: S, layout: &Layout, source: &Source<'_>, plane: usize, slot: &mut [u8]) {
    simd.vectorize(
        #[inline(always)]
        || {
            let [even, odd] = &source.planes;
            for label in 0..layout.labels {
                let (from, to) = (label * source.lanes, &mut slot[label * layout.lanes..][..layout.lanes]);
                for at in (0..layout.nodes(plane)).step_by(2 * S::u8s::LEN) {
                    let (low, high) = even.load(simd, from, at / 2).interleave(odd.load(simd, from, at / 2));
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
    /// The messages of a vector of lanes, for the label that starts at `from`; zeros where a lane has no sender.
    #[inline(always)]
    fn load<S: Simd>(&self, simd: S, from: usize, lane: usize) -> S::u8s {
        let values = match (from + lane).checked_add_signed(self.moved) {
            Some(from) => S::u8s::from_slice(simd, &self.values[from..from + S::u8s::LEN]),
            // There is no lane before the first. The mask drops it.
            None => S::u8s::from_fn(simd, |i| if i == 0 { 0 } else { self.values[i - 1] }),
        };
        match self.mask {
            Some(mask) => {
                let start = (BLOCK + lane).wrapping_add_signed(self.moved);
                values & S::u8s::from_slice(simd, &mask[start..start + S::u8s::LEN])
            }
            None => values,
        }
    }
}
