//! First messages of a grid.
//!
//! In the terms of `bp-cpu-scalar`, the kernel computes:
//!
//! ```text
//! for each node (x, y) and each side on which it has a neighbour:
//!     message(x, y) from side = message(parent of (x, y)) from side, on the next coarser grid
//! ```
//!
//! Under `sweep`, it interpolates between the four nearest coarse nodes; see [`Between`].
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
        let swept = plan.settings().schedule == Schedule::Sweep;
        let source = |aside| coarser.and_then(|coarser| source(plan, coarser, at, side, aside));
        match (source(Aside::default()), coarser) {
            (Some(near), Some(coarser)) if swept => {
                let between = Between::new(near, coarser.layout, at, side, source);
                dispatch!(level, simd => between.expand(simd, layout, at.plane, slot));
            }
            (Some(near), _) => dispatch!(level, simd => near.expand(simd, layout, at.plane, slot)),
            (None, _) => slot[..layout.plane()].fill(0),
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

/// How far beside a parent messages are taken.
#[derive(Clone, Copy, Default)]
struct Aside {
    rows: isize,
    lanes: isize,
}

/// The source of the first messages from `side` for the nodes of a plane in a row. `None` if that coarse row does not
/// exist or has no neighbours on that side.
fn source<'a>(plan: &Plan, coarser: Coarser<'a>, at: PlaneRow, side: Side, aside: Aside) -> Option<Source<'a>> {
    let PlaneRow { plane, y } = at;
    let layout = coarser.layout;
    let by_sender = plan.settings().message_start == MessageStart::Sender;
    // If sender and receiver share a parent, this parent sends to the adjacent coarse row.
    let rows = match side {
        Side::Up if by_sender => y as isize % 2,
        Side::Down if by_sender => y as isize % 2 - 1,
        _ => aside.rows,
    };
    let y = (y / 2).checked_add_signed(rows).filter(|&y| y < layout.size.height)?;
    let columns =
        if plan.settings().schedule == Schedule::Sweep { swept(side, y)? } else { columns(side, plane, by_sender) };
    let [even, odd] = columns.map(|(plane, moved)| {
        let (moved, received) = (moved + aside.lanes, &coarser.received[(plane + y) % 2]);
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

/// The first messages of a swept grid: interpolated between the parents' row and the next nearest one, `far`. Messages
/// from below are also interpolated between columns.
struct Between<'a> {
    near: Source<'a>,
    far: Source<'a>,
    /// The columns beside the parents, in both rows: to the left for plane 0, to the right for plane 1.
    beside: Option<Beside<'a>>,
}

struct Beside<'a> {
    near: Parents<'a>,
    far: Parents<'a>,
    /// For the parents in even and in odd columns, 255 where there is such a column.
    exists: [&'a [u8]; 2],
}

impl<'a> Between<'a> {
    fn new(
        near: Source<'a>,
        coarser: &'a Layout,
        at: PlaneRow,
        side: Side,
        source: impl Fn(Aside) -> Option<Source<'a>>,
    ) -> Self {
        let rows = if at.y % 2 == 1 { 1 } else { -1 };
        let lanes = if at.plane == 1 { 1 } else { -1 };
        // Beside the other parents lie the first ones.
        let beside = |rows| source(Aside { rows, lanes }).map(|source| source.planes[1 - at.plane]);
        let to = if at.plane == 1 { Side::Right } else { Side::Left };
        let exists = [0, 1].map(|plane| &coarser.padded_masks(plane)[slot(to, plane)][BLOCK..]);
        let with_columns = |near| Beside { near, far: beside(rows).unwrap_or(near), exists };
        Self {
            near,
            far: source(Aside { rows, lanes: 0 }).unwrap_or(near),
            beside: beside(0).filter(|_| side == Side::Down).map(with_columns),
        }
    }

    /// Writes the first messages of the nodes of `plane`.
    #[inline(always)]
    fn expand<S: Simd>(&self, simd: S, layout: &Layout, plane: usize, slot: &mut [u8]) {
        let lanes = self.near.lanes;
        match &self.beside {
            Some(beside) => interleave(
                simd,
                layout,
                plane,
                slot,
                #[inline(always)]
                |label, lane| {
                    let from = label * lanes + lane;
                    beside.between_columns(simd, self.between_rows(simd, from, lane), from, lane, plane)
                },
            ),
            None => interleave(
                simd,
                layout,
                plane,
                slot,
                #[inline(always)]
                |label, lane| self.between_rows(simd, label * lanes + lane, lane),
            ),
        }
    }

    #[inline(always)]
    fn between_rows<S: Simd>(&self, simd: S, from: usize, lane: usize) -> [S::u8s; 2] {
        let [even, odd] = self.near.load(simd, from, lane);
        let [far_even, far_odd] = self.far.load(simd, from, lane);
        [nearer(simd, even, far_even), nearer(simd, odd, far_odd)]
    }
}

impl Beside<'_> {
    #[inline(always)]
    fn between_columns<S: Simd>(
        &self,
        simd: S,
        [even, odd]: [S::u8s; 2],
        from: usize,
        lane: usize,
        plane: usize,
    ) -> [S::u8s; 2] {
        let beside = nearer(simd, self.near.load(simd, from, lane), self.far.load(simd, from, lane));
        let beside = if plane == 0 { [beside, even] } else { [odd, beside] };
        let clamp = |exists: &[u8], parent: S::u8s, beside: S::u8s| {
            let exists = S::u8s::from_slice(simd, &exists[lane..lane + S::u8s::LEN]);
            (beside & exists) | (parent & !exists)
        };
        let [at_even, at_odd] = self.exists;
        [nearer(simd, even, clamp(at_even, even, beside[0])), nearer(simd, odd, clamp(at_odd, odd, beside[1]))]
    }
}

/// Three quarters of `near` and one of `far`, as two means that are rounded up.
#[inline(always)]
fn nearer<S: Simd>(simd: S, near: S::u8s, far: S::u8s) -> S::u8s {
    mean(simd, mean(simd, near, far), near)
}

/// The mean, rounded up.
#[inline(always)]
fn mean<S: Simd>(simd: S, a: S::u8s, b: S::u8s) -> S::u8s {
    let (a, b) = (a.as_slice(), b.as_slice());
    // Compilers know this as one instruction.
    S::u8s::from_fn(
        simd,
        #[inline(always)]
        |i| ((u16::from(a[i]) + u16::from(b[i]) + 1) >> 1) as u8,
    )
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
