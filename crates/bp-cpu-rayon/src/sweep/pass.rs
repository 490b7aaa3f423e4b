//! Passes over rows that are passed together: a band, or those around a seam.
//!
//! A row is processed patch by patch, and its second colour one patch behind the first, so that it finds in cache what the
//! first one wrote.

use std::ops::Range;

use fearless_simd::{Simd, dispatch};

use super::{
    Sweep, Work,
    lists::Lists,
    messages::{Messages, Place},
    padded::Padded,
    refine::At,
    send::{self, Slots, to_sides},
};
use crate::{
    block::{Block, LANES},
    greys::Around,
};

/// The messages that a pass down starts with.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Start {
    /// Those that the edges hold.
    Held,
    /// The first messages of all rows.
    Refined,
    /// The first messages of all rows. The last row holds those from below already, which came across a seam.
    RefinedAboveSeam,
}

/// Rows that are passed together.
pub(crate) struct Pass<'a> {
    pub(crate) sweep: &'a Sweep<'a>,
    pub(crate) rows: Range<usize>,
    pub(crate) lists: &'a Lists,
    pub(crate) messages: &'a mut Messages,
    pub(crate) work: &'a mut Work,
}

/// The direction of a pass over the rows.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Way {
    Down,
    Up,
}

/// What the nodes of a block send.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Sends {
    Sides,
    SidesAndAhead,
    Ahead,
}

/// The nodes of a plane of a patch in row y.
#[derive(Clone, Copy)]
struct Nodes<'a> {
    patch: usize,
    plane: usize,
    y: usize,
    greys: Option<Around<'a>>,
}

impl Pass<'_> {
    /// Passes down all rows.
    pub(crate) fn forward(&mut self, start: Start) {
        self.work.coarse_rows.clear();
        let level = self.sweep.level;
        for y in self.rows.clone() {
            dispatch!(level, simd => self.forward_row(simd, y, start));
        }
    }

    /// Passes up these rows.
    pub(crate) fn backward(&mut self, rows: Range<usize>) {
        let level = self.sweep.level;
        for y in rows.rev() {
            dispatch!(level, simd => self.backward_row(simd, y));
        }
    }

    /// Even nodes send left, right and down; then odd nodes send down. The last row sends nothing down.
    #[inline(always)]
    fn forward_row<S: Simd>(&mut self, simd: S, y: usize, start: Start) {
        let onward = y + 1 < self.rows.end && self.sweep.layout.joined_above(y + 1);
        let (even, odd) = (y % 2, 1 - y % 2);
        let greys = [0, 1].map(|plane| self.sweep.layout.around(plane, y));
        if let Some(coarser) = self.sweep.coarser.filter(|_| start != Start::Held) {
            self.work.coarse_rows.read(simd, coarser, self.lists, y);
        }
        for patch in 0..=self.lists.patches() {
            if patch < self.lists.patches() {
                if start != Start::Held {
                    self.first_visit(simd, patch, y, start);
                }
                let sends = if onward { Sends::SidesAndAhead } else { Sends::Sides };
                self.send(simd, Way::Down, Nodes { patch, plane: even, y, greys: greys[even] }, sends);
                self.close(patch, y);
                self.cross(Nodes { patch, plane: even, y, greys: greys[0] });
            }
            if let Some(patch) = patch.checked_sub(1).filter(|_| onward) {
                self.send(simd, Way::Down, Nodes { patch, plane: odd, y, greys: greys[odd] }, Sends::Ahead);
            }
        }
    }

    /// Odd nodes send left, right and up; then even nodes send up. The first row sends nothing up.
    #[inline(always)]
    fn backward_row<S: Simd>(&mut self, simd: S, y: usize) {
        let onward = y > self.rows.start && self.sweep.layout.joined_above(y);
        let (even, odd) = (y % 2, 1 - y % 2);
        let greys = [0, 1].map(|plane| self.sweep.layout.around(plane, y));
        let upwards = greys.map(|greys| greys.map(Around::upwards));
        for patch in 0..=self.lists.patches() {
            if patch < self.lists.patches() {
                let sends = if onward { Sends::SidesAndAhead } else { Sends::Sides };
                self.send(simd, Way::Up, Nodes { patch, plane: odd, y, greys: upwards[odd] }, sends);
                self.close(patch, y);
                self.cross(Nodes { patch, plane: odd, y, greys: greys[0] });
            }
            if let Some(patch) = patch.checked_sub(1).filter(|_| onward) {
                self.send(simd, Way::Up, Nodes { patch, plane: even, y, greys: upwards[even] }, Sends::Ahead);
            }
        }
    }

    /// The edges up from row y.
    pub(crate) fn up_mut(&mut self, y: usize) -> &mut [Block] {
        self.messages.up_mut(self.lists.entries(), y - self.rows.start)
    }

    /// Computes the costs of a patch in row y, and the first messages that a pass down needs: those of even nodes, and in the
    /// last row also those that odd nodes hold from below.
    #[inline(always)]
    fn first_visit<S: Simd>(&mut self, simd: S, patch: usize, y: usize, start: Start) {
        let (entries, range, row) = (self.lists.entries(), self.lists.range(patch), y - self.rows.start);
        if self.sweep.costs.ready(self.sweep, patch, 0, y).is_none() {
            let (even, odd) = self.work.costs[2 * row * entries..2 * (row + 1) * entries].split_at_mut(entries);
            let costs = [&mut even[range.clone()], &mut odd[range.clone()]];
            self.sweep.costs.fill(simd, self.sweep, patch, y, self.lists.list(patch).labels, costs);
        }
        let last = y + 1 == self.rows.end;
        let below = !last || start == Start::Refined;
        let joined = self.sweep.layout.joined_above(y + 1);
        for plane in 0..2 {
            let sides = plane == y % 2;
            let mut around = self.messages.around(&Place { entries, row, plane, range: &range });
            if let Some(coarser) = self.sweep.coarser {
                let coarser_height = coarser.layout.size.height;
                let at = At { lists: self.lists, patch, plane, y, coarser_height };
                let below = below && (sides || last);
                self.work.coarse_rows.interpolate(simd, &at, sides, below, &mut around);
            } else {
                around.same.fill(Block::ZERO);
                around.next.fill(Padded::ZERO);
            }
            if below && self.sweep.coarser.is_none() || !joined {
                around.below.fill(Block::ZERO);
            }
        }
        self.close(patch, y);
    }

    #[inline(always)]
    fn send<S: Simd>(&mut self, simd: S, way: Way, at: Nodes<'_>, sends: Sends) {
        let Nodes { patch, plane, y, greys } = at;
        let (entries, range, row) = (self.lists.entries(), self.lists.range(patch), y - self.rows.start);
        let place = Place { entries, row, plane, range: &range };
        let around = self.messages.around(&place);
        let nodes = send::Nodes {
            plane,
            list: self.lists.list(patch),
            costs: self.work.costs(self.sweep, patch, y, &place),
            edges: self.sweep.plan.model().edges(),
            greys: greys.map(|around| (around, LANES * patch)),
        };
        let (behind, ahead) = match way {
            Way::Down => (around.above, around.below),
            Way::Up => (around.below, around.above),
        };
        let slots = Slots { same: around.same, next: around.next, behind, ahead };
        match (sends, nodes.greys.is_some()) {
            (Sends::Sides, false) => to_sides::<_, false, false>(simd, &nodes, slots),
            (Sends::Sides, true) => to_sides::<_, true, false>(simd, &nodes, slots),
            (Sends::SidesAndAhead, false) => to_sides::<_, false, true>(simd, &nodes, slots),
            (Sends::SidesAndAhead, true) => to_sides::<_, true, true>(simd, &nodes, slots),
            (Sends::Ahead, false) => send::ahead::<_, false>(simd, &nodes, slots),
            (Sends::Ahead, true) => send::ahead::<_, true>(simd, &nodes, slots),
        }
    }

    /// Sets the messages of a patch over horizontal edges that do not exist to zeros.
    #[inline(always)]
    fn close(&mut self, patch: usize, y: usize) {
        if self.sweep.gaps.iter().flatten().any(|gap| gap.patch == patch) {
            self.close_gaps(patch, y);
        }
    }

    fn close_gaps(&mut self, patch: usize, y: usize) {
        let entries = self.lists.entries();
        let range = self.lists.range(patch);
        let inside = (y - self.rows.start) * entries;
        let inside = inside + range.start..inside + range.end;
        for &Gap { edge, .. } in self.sweep.gaps.iter().flatten().filter(|gap| gap.patch == patch) {
            match edge {
                Edge::Same(lane) => self.messages.same[inside.clone()].iter_mut().for_each(|block| block.0[lane] = 0),
                Edge::Next(lane) => {
                    self.messages.next[inside.clone()].iter_mut().for_each(|block| *block.lane_mut(lane) = 0);
                }
            }
        }
    }

    /// Carries the messages that the nodes of `plane` sent between this patch and the one before to the other of the two.
    fn cross(&mut self, at: Nodes<'_>) {
        let Nodes { patch, plane, y, greys } = at;
        let Some(before) = patch.checked_sub(1) else { return };
        let lane = LANES * patch;
        let level = greys.map_or(0, |around| around.level(1, lane));
        let truncation = self.sweep.plan.model().edges().smoothness()[level].truncation;
        let inside = (y - self.rows.start) * self.lists.entries();
        let next = &mut self.messages.next[inside..inside + self.lists.entries()];
        let (left, right) = next[self.lists.range(before).start..self.lists.range(patch).end]
            .split_at_mut(self.lists.range(before).len());
        let end = LANES as isize - 1;
        let crossings = &self.work.crossings;
        if plane == 1 {
            let route = crossings.of(self.lists, patch, 0);
            route.carry(level, truncation, left, |sent| sent.lane(end), right, -1);
        } else {
            let route = crossings.of(self.lists, before, 1);
            route.carry(level, truncation, right, |sent| sent.lane(-1), left, end);
        }
    }
}

/// A horizontal edge that does not exist.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Gap {
    patch: usize,
    edge: Edge,
}

/// The slot of an edge in a patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Edge {
    Same(usize),
    Next(isize),
}

/// The edges that do not exist in a row of this width: those at both borders, and one at a cut before column `cut`.
pub(crate) fn gaps(width: usize, cut: Option<usize>) -> [Option<Gap>; 4] {
    let after = |x: usize| {
        let (patch, lane) = (x / (2 * LANES), x / 2 % LANES);
        Gap { patch, edge: if x.is_multiple_of(2) { Edge::Same(lane) } else { Edge::Next(lane as isize) } }
    };
    let before_patch = |patch: usize| Gap { patch, edge: Edge::Next(-1) };
    let cut = cut.filter(|&x| x > 0);
    // The edge between two patches belongs to both.
    let between = cut.filter(|x| x.is_multiple_of(2 * LANES)).map(|x| before_patch(x / (2 * LANES)));
    [Some(before_patch(0)), Some(after(width - 1)), cut.map(|x| after(x - 1)), between]
}
