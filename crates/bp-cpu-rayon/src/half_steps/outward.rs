//! The schedule `outward`: nodes send one after another, those nearest to the start node first.
//!
//! The first set of messages holds those that even nodes received, the second those of odd nodes. So a node reads one set and
//! writes the other. Only one node of a row can send at a time, so there are no vectors here. Once the start row has sent, the
//! rows above it and those below it do not depend on each other: two threads share a loop.

use std::ops::Range;

use bp_core::{Node, Side, Smoothness};

use super::{edges, pass::Pass, refine::slot};

/// Runs loops on both sets.
pub(super) fn run(grid: &Pass<'_>, start: Node, loops: Range<usize>, mut sets: [&mut [u8]; 2]) {
    if loops.start == 0 && !grid.keeps_messages {
        sets.iter_mut().for_each(|set| set.fill(0));
    }
    let row_bytes = edges::row_bytes(grid.layout);
    for _ in loops {
        grid.send_rows(
            start,
            start.y,
            start.y..start.y + 1,
            sets.each_mut().map(|set| &mut set[start.y * row_bytes..]),
        );
        let [even, odd] = sets.each_mut().map(|set| set.split_at_mut((start.y + 1) * row_bytes));
        rayon::join(
            || grid.send_rows(start, 0, (0..start.y).rev(), [even.0, odd.0]),
            || grid.send_rows(start, start.y + 1, start.y + 1..grid.layout.size.height, [even.1, odd.1]),
        );
    }
}

/// A node that sends, and what its messages depend on, by slot.
struct Sender<'a> {
    /// Data costs `[label][lane]`.
    costs: &'a [u8],
    lanes: usize,
    lane: usize,
    smoothness: [Smoothness; 4],
    /// Whether there is a neighbour.
    is_joined: [bool; 4],
}

impl Pass<'_> {
    /// Sends from the nodes of these rows. The sets begin with row `first`.
    fn send_rows(&self, start: Node, first: usize, rows: impl Iterator<Item = usize>, [even, odd]: [&mut [u8]; 2]) {
        for y in rows {
            let from = (y - first) * edges::row_bytes(self.layout);
            for x in (0..=start.x).rev().chain(start.x + 1..self.layout.size.width) {
                let node = Node { x, y };
                let (received, sent) = if node.is_even() { (&mut *even, &mut *odd) } else { (&mut *odd, &mut *even) };
                let slots = |set| edges::slots(self.layout, set, x % 2);
                self.sender(node).send(slots(&mut received[from..]), slots(&mut sent[from..]));
            }
        }
    }

    fn sender(&self, node: Node) -> Sender<'_> {
        let (layout, plane, lane) = (self.layout, node.x % 2, node.x / 2);
        let (smoothness, around) = (self.plan.model().edges().smoothness(), layout.around(plane, node.y));
        let mut is_joined = [false; 4];
        for side in Side::ALL {
            is_joined[slot(side, plane)] = self.plan.neighbour(0, node, side).is_some();
        }
        let level = |slot| around.filter(|_| is_joined[slot]).map_or(0, |around| around.level(slot, lane));
        Sender {
            costs: &self.costs[node.y * layout.row() + plane * layout.plane()..][..layout.plane()],
            lanes: layout.lanes,
            lane,
            smoothness: [0, 1, 2, 3].map(|slot| smoothness[level(slot)]),
            is_joined,
        }
    }
}

impl Sender<'_> {
    /// Sends to all neighbours, in the two passes of [`super::update_messages`]. Between them, the slots hold the envelope.
    fn send(&self, received: [&mut [u8]; 4], sent: [&mut [u8]; 4]) {
        let (mut envelope, mut least) = ([u8::MAX; 4], [u8::MAX; 4]);
        for at in (self.lane..self.costs.len()).step_by(self.lanes) {
            let h = gather(self.costs[at], received.each_ref().map(|slot| slot[at]));
            for slot in (0..4).filter(|&slot| self.is_joined[slot]) {
                envelope[slot] = envelope[slot].saturating_add(self.smoothness[slot].step()).min(h[slot]);
                least[slot] = least[slot].min(envelope[slot]);
                sent[slot][at] = envelope[slot];
            }
        }
        envelope = [u8::MAX; 4];
        for at in (self.lane..self.costs.len()).step_by(self.lanes).rev() {
            for slot in (0..4).filter(|&slot| self.is_joined[slot]) {
                let Smoothness { truncation, .. } = self.smoothness[slot];
                envelope[slot] = envelope[slot].saturating_add(self.smoothness[slot].step()).min(sent[slot][at]);
                sent[slot][at] = (envelope[slot] - least[slot]).min(truncation);
            }
        }
    }
}

/// The data cost plus the messages received in the other three slots, for each slot.
fn gather(cost: u8, [same, next, up, down]: [u8; 4]) -> [u8; 4] {
    [up + down + next, up + down + same, same + next + down, same + next + up].map(|others| cost.saturating_add(others))
}
