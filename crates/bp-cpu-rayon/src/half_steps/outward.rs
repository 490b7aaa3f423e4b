//! The schedule `outward`: nodes send one after another, those nearest to the start node first.
//!
//! The first set of messages holds those that even nodes received, the second those of odd nodes. So a node reads one set and
//! writes the other. Only one node of a row can send at a time, so there are no vectors here. Once the start row has sent, the
//! rows above it and those below it do not depend on each other: two threads share a loop.

use std::ops::Range;

use bp_core::{Node, Side, Smoothness};
use rayon::prelude::*;

use super::{
    edges::{self, Slots, slot},
    labels,
    pass::Pass,
};
use crate::{
    block::{Block, LANES},
    shape::PlaneRow,
};

/// Runs loops on both sets, and then decides labels, if there is room for them.
pub(super) fn run(
    grid: &Pass<'_>,
    start: Node,
    loops: Range<usize>,
    mut sets: [&mut [Block]; 2],
    labels: [&mut [Block]; 2],
) {
    if loops.start == 0 && !grid.keeps_messages {
        sets.iter_mut().for_each(|set| set.fill(Block::ZERO));
    }
    let row = edges::row(grid.layout);
    for _ in loops {
        grid.send_rows(start, start.y, start.y..start.y + 1, sets.each_mut().map(|set| &mut set[start.y * row..]));
        let [even, odd] = sets.each_mut().map(|set| set.split_at_mut((start.y + 1) * row));
        rayon::join(
            || grid.send_rows(start, 0, (0..start.y).rev(), [even.0, odd.0]),
            || grid.send_rows(start, start.y + 1, start.y + 1..grid.layout.size.height, [even.1, odd.1]),
        );
    }
    for (colour, (set, labels)) in sets.iter().zip(labels).enumerate() {
        labels.par_chunks_exact_mut(labels::row(grid.layout)).enumerate().for_each(|(y, labels)| {
            grid.decide(PlaneRow { plane: (y + colour) % 2, y }, &set[y * row..], labels);
        });
    }
}

/// A node that sends, and what its messages depend on, by slot.
struct Sender<'a> {
    /// Data costs of its block, `[label]`.
    costs: &'a [Block],
    lane: usize,
    smoothness: [Smoothness; 4],
    /// Whether there is a neighbour.
    is_joined: [bool; 4],
}

/// The messages of one node in one slot: a lane of a block. Empty at the end of a row.
struct Held<'a> {
    values: &'a mut [Block],
    lane: usize,
}

impl Held<'_> {
    fn get(&self, label: usize) -> u8 {
        self.values.get(label).map_or(0, |block| block.0[self.lane])
    }

    fn set(&mut self, label: usize, value: u8) {
        if let Some(block) = self.values.get_mut(label) {
            block.0[self.lane] = value;
        }
    }
}

impl Pass<'_> {
    /// Sends from the nodes of these rows. The sets begin with row `first`.
    fn send_rows(&self, start: Node, first: usize, rows: impl Iterator<Item = usize>, [even, odd]: [&mut [Block]; 2]) {
        for y in rows {
            let from = (y - first) * edges::row(self.layout);
            for x in (0..=start.x).rev().chain(start.x + 1..self.layout.size.width) {
                let node = Node { x, y };
                let (received, sent) = if node.is_even() { (&mut *even, &mut *odd) } else { (&mut *odd, &mut *even) };
                let (received, sent) = (self.held(node, &mut received[from..]), self.held(node, &mut sent[from..]));
                self.sender(node).send(&received, sent);
            }
        }
    }

    /// What a set holds for a node, by slot. Rows start with that of the node.
    fn held<'a>(&self, node: Node, rows: &'a mut [Block]) -> [Held<'a>; 4] {
        let Slots { values, moving } = edges::slots(self.layout, rows, node.x % 2);
        let mut slot = 0;
        values.map(|values| {
            let lane = node.x / 2 + usize::from(slot == 1 && moving.is_some());
            slot += 1;
            Held { values: values.get_mut(self.layout.block(lane / LANES)).unwrap_or_default(), lane: lane % LANES }
        })
    }

    fn sender(&self, node: Node) -> Sender<'_> {
        let (layout, plane, lane) = (self.layout, node.x % 2, node.x / 2);
        let (smoothness, around) = (self.plan.model().edges().smoothness(), layout.around(plane, node.y));
        let mut is_joined = [false; 4];
        for side in Side::ALL {
            is_joined[slot(side, plane)] = self.plan.neighbour(0, node, side).is_some();
        }
        let level = |slot| around.filter(|_| is_joined[slot]).map_or(0, |around| around.level(slot, lane));
        let first = node.y * layout.row() + plane * layout.plane();
        Sender {
            costs: &self.costs[first..][layout.block(lane / LANES)],
            lane: lane % LANES,
            smoothness: [0, 1, 2, 3].map(|slot| smoothness[level(slot)]),
            is_joined,
        }
    }
}

impl Sender<'_> {
    /// Sends to all neighbours, in the two passes of [`super::update_messages`]. Between them, the slots hold the envelope.
    fn send(&self, received: &[Held<'_>; 4], mut sent: [Held<'_>; 4]) {
        let (mut envelope, mut least) = ([u8::MAX; 4], [u8::MAX; 4]);
        for (label, cost) in self.costs.iter().enumerate() {
            let h = gather(cost.0[self.lane], received.each_ref().map(|held| held.get(label)));
            for slot in (0..4).filter(|&slot| self.is_joined[slot]) {
                envelope[slot] = envelope[slot].saturating_add(self.smoothness[slot].step()).min(h[slot]);
                least[slot] = least[slot].min(envelope[slot]);
                sent[slot].set(label, envelope[slot]);
            }
        }
        envelope = [u8::MAX; 4];
        for label in (0..self.costs.len()).rev() {
            for slot in (0..4).filter(|&slot| self.is_joined[slot]) {
                let Smoothness { truncation, .. } = self.smoothness[slot];
                envelope[slot] = envelope[slot].saturating_add(self.smoothness[slot].step()).min(sent[slot].get(label));
                sent[slot].set(label, (envelope[slot] - least[slot]).min(truncation));
            }
        }
    }
}

/// The data cost plus the messages received in the other three slots, for each slot.
fn gather(cost: u8, [same, next, up, down]: [u8; 4]) -> [u8; 4] {
    [up + down + next, up + down + same, same + next + down, same + next + up].map(|others| cost.saturating_add(others))
}
