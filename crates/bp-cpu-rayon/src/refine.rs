//! First messages of a grid.

use bp_core::{MessageStart, Plan, Schedule, Side};
use fearless_simd::{Level, Simd, SimdBase, dispatch};

use crate::{edges::Rows, layout::Layout, shape::BLOCK};

/// The last messages of the next coarser grid.
#[derive(Clone, Copy)]
pub(crate) struct Coarser<'a> {
    /// Its layout.
    pub(crate) layout: &'a Layout,
    /// What its nodes of either checkerboard colour received.
    pub(crate) received: [Rows<'a>; 2],
}

/// Gives the nodes of `plane` in row `y` of a grid the messages that they start with on `sides`; zeros where there is no
/// coarser grid. A node does so just before it sends for the first time, so that all of it happens in cache.
pub(crate) fn refine(
    level: Level,
    plan: &Plan,
    layout: &Layout,
    coarser: Option<Coarser<'_>>,
    (plane, y): (usize, usize),
    sides: &[Side],
    slots: &mut [&mut [u8]; 4],
) {
    for &side in sides {
        let slot = &mut *slots[slot(side, plane)];
        match coarser.and_then(|coarser| source(plan, coarser, (plane, y), side)) {
            Some(source) => dispatch!(level, simd => expand(simd, layout, &source, plane, slot)),
            None => slot[..layout.plane()].fill(0),
        }
    }
}

/// Which slot of a node of `plane` leads to `side`.
pub(crate) fn slot(side: Side, plane: usize) -> usize {
    match (side, plane) {
        (Side::Right, 0) | (Side::Left, 1) => 0,
        (Side::Left | Side::Right, _) => 1,
        (Side::Up, _) => 2,
        (Side::Down, _) => 3,
    }
}

/// Where fine nodes take their first messages from: those of lane i from lane i div 2 of `planes[i % 2]`.
struct Source<'a> {
    lanes: usize,
    planes: [Parents<'a>; 2],
}

/// The nodes of a coarse row and plane that messages are taken from.
struct Parents<'a> {
    /// What they received, `[label][lane]`.
    values: &'a [u8],
    /// 255 where a lane has a neighbour that sends, else 0, from a block before the first lane on.
    mask: Option<&'a [u8]>,
    /// By how many lanes further on messages are taken.
    moved: isize,
}

/// Where the nodes of `plane` in row `y` take their first message from `side` from; nowhere where the coarse row of
/// theirs does not exist, or has no neighbours there.
fn source<'a>(plan: &Plan, coarser: Coarser<'a>, (plane, y): (usize, usize), side: Side) -> Option<Source<'a>> {
    let layout = coarser.layout;
    let by_sender = plan.settings().message_start == MessageStart::Sender;
    // A sender's parent sends to the coarse row one further on, if that is not the receiver's own parent too.
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

/// For even and odd lanes of a fine plane, whose lane i has coarse column i as parent: the coarse plane that messages
/// are taken from, and by how many lanes moved.
fn columns(side: Side, plane: usize, by_sender: bool) -> [(usize, isize); 2] {
    match (side, plane) {
        // A sender's parent sends to one column further on than the receiver's own.
        (Side::Left, 1) if by_sender => [(1, 0), (0, 1)],
        (Side::Right, 0) if by_sender => [(1, -1), (0, 0)],
        _ => [(0, 0), (1, 0)],
    }
}

/// The same after a sweep on coarse row `y`: only even nodes hold messages from left and right, so that in place of an
/// odd one its neighbour on that side is asked. Nothing comes from above.
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

/// Writes first messages of the nodes of `plane`.
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
    /// The messages of a vector of lanes of the label that starts at `from`; zeros where a lane has no sender.
    #[inline(always)]
    fn load<S: Simd>(&self, simd: S, from: usize, lane: usize) -> S::u8s {
        let values = match (from + lane).checked_add_signed(self.moved) {
            Some(from) => S::u8s::from_slice(simd, &self.values[from..from + S::u8s::LEN]),
            // The lane before the first: the mask drops it.
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
